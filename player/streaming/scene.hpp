#pragma once
// The scene for the passes: scene.json joined with the textures and meshes of the streamer.

#include "assets/scene/file.hpp"
#include "scene/instances.hpp"
#include "scene/view.hpp"
#include "streaming/streamer.hpp"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <span>
#include <string_view>
#include <vector>

namespace paradize {

/// A material with its maps.
struct Material {
    assets::Material values;
    assets::PerMap<const StreamedTexture *> maps; // nullptr: it has no such map
    std::uint32_t id = 0; // the same for materials that differ in their names only; below material_count()
    // of casters: the same for materials whose shadows are drawn alike, the id of the first of them. Where
    // nothing shines through, they sway both or not and beat alike.
    std::uint32_t shadow_id = 0;
    glm::vec3 center{0.0F}; // of its triangles, in the positions' own units
};

struct Object {
    const assets::Object *file = nullptr;
    const StreamedMesh *mesh = nullptr;
    std::vector<Material> materials; // one entry per name in mesh->materials(), same order
    std::vector<Instance> instances; // in the order of the tree
    InstanceTree tree;
    std::vector<float> errors_m; // of its levels
    bool dry = true;             // no instance reaches under the water
    bool glows = false;          // a material gives off light, which is seen however small
    // what its instances have of SceneFile::light_sets, each once; the first is 0: no light
    std::vector<std::uint32_t> light_sets{0};

    bool moves() const { return file != nullptr && file->motion.has_value(); }
    /// Leaves out instances no wider than the accepted error, as if a level of no triangles were the
    /// coarsest. The light's view keeps them: its shadow map would be drawn anew for each that comes or goes.
    LodQuery lod_query(ViewKind view, const glm::vec3 &eye, float pixels_at_1m, float error_px) const {
        const bool leaves_out = view != ViewKind::light && !glows;
        return {eye, pixels_at_1m, error_px, errors_m, leaves_out ? error_px : 0.0F};
    }
};

/// Instances of an object to draw in one view: neighbours in its list, all of one winding, with a level of
/// detail that is resident.
struct DrawItem {
    const Object *object = nullptr;
    std::uint32_t first = 0, count = 0; // of Object::instances
    int lod = 0;
    bool mirrored = false;

    std::span<const Instance> instances() const { return std::span(object->instances).subspan(first, count); }
};

class Scene {
  public:
    /// Joins objects with their maps and materials. `file` and `streamer` must outlive the scene. Throws
    /// Error if scene.json and the meshes disagree.
    Scene(const assets::SceneFile &file, const Streamer &streamer);
    Scene(const Scene &) = delete;
    Scene &operator=(const Scene &) = delete;

    /// Places what moves where it is at a second of the flight.
    void move(double flight_s);

    const assets::SceneFile &file() const { return file_; }
    std::span<const Object> objects() const { return objects_; }

    /// Returns nullptr for an empty name. Every name in the scene file is valid, because references are
    /// checked when scene.json is read.
    const StreamedTexture *texture(std::string_view artifact) const;
    const StreamedMesh *mesh(std::string_view artifact) const;
    const Streamer &streamer() const { return streamer_; }

    std::size_t instance_count() const { return instance_count_; }
    std::uint32_t material_count() const { return static_cast<std::uint32_t>(distinct_materials_.size()); }
    /// Appends the visible instances of `view` to `items`, object by object in the order of their lists,
    /// culled by their bounding spheres. Picks for each the coarsest level with an error of at most
    /// `error_px` pixels seen from `eye`. The light view uses the main view's eye, so that shadows fit their
    /// casters. The capacity of `items` must hold instance_count() already.
    void collect(const View &view, const glm::vec3 &eye, float pixels_at_1m, float error_px,
                 std::vector<DrawItem> &items) const;

  private:
    void add_instances(Object &object);

    const assets::SceneFile &file_;
    const Streamer &streamer_;
    std::uint32_t id_of(assets::Material material);
    std::uint32_t shadow_id_of(std::uint32_t id) const;

    std::vector<Object> objects_;
    std::vector<assets::Material> distinct_materials_; // without names
    std::size_t instance_count_ = 0;
};

/// True if the object is drawn in views of this kind.
bool drawn_in(const assets::Object &object, ViewKind view);

/// Returns the scale and bias of a material's parallax. Both are reduced if the largest displacement, scale /
/// 2 + |bias|, exceeds the material's limit.
glm::vec2 parallax_of(const assets::Material &material);

} // namespace paradize
