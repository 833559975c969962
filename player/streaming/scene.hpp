#pragma once
// The scene as the passes see it: what scene.json says, joined with the textures and meshes that the streamer
// fills.

#include "assets/scene_file.hpp"
#include "scene/view.hpp"
#include "streaming/streamer.hpp"

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <span>
#include <string_view>
#include <vector>

namespace paradize {

struct Instance {
    glm::dmat4 model{1.0};  // world from mesh
    glm::dvec3 center{0.0}; // bounding sphere in the world
    float radius_m = 0.0F;
    float scale = 1.0F;
};

struct Object {
    const assets::Object *file = nullptr;
    const StreamedMesh *mesh = nullptr;
    assets::PerMap<const StreamedTexture *> maps; // nullptr: the object has no such map
    std::vector<assets::Material> materials;      // one per name in mesh->materials(), same order
    std::vector<Instance> instances;
};

/// One instance to draw in one view, at a level whose data is resident.
struct DrawItem {
    const Object *object = nullptr;
    const Instance *instance = nullptr;
    int lod = 0;
};

class Scene {
  public:
    /// Joins objects with their maps and materials. Throws Error when scene.json and the meshes disagree.
    /// Both outlive the scene.
    Scene(const assets::SceneFile &file, const Streamer &streamer);
    Scene(const Scene &) = delete;
    Scene &operator=(const Scene &) = delete;

    const assets::SceneFile &file() const { return file_; }
    std::span<const Object> objects() const { return objects_; }

    /// By artifact name; nullptr for an empty name. The scene file's references are checked when it is read,
    /// so that a name of the scene file is always there.
    const StreamedTexture *texture(std::string_view artifact) const;
    const StreamedMesh *mesh(std::string_view artifact) const;
    const Streamer &streamer() const { return streamer_; }

    std::size_t instance_count() const { return instance_count_; }
    /// Culls by sphere and picks levels; appends to `items`, whose capacity must hold instance_count()
    /// already. Levels are picked for `eye` (the light's view takes the picture's, so that shadows fit their
    /// casters), the coarsest with an error of at most `error_px` pixels.
    void collect(const View &view, const glm::vec3 &eye, float pixels_at_1m, float error_px,
                 std::vector<DrawItem> &items) const;

  private:
    const assets::SceneFile &file_;
    const Streamer &streamer_;
    std::vector<Object> objects_;
    std::size_t instance_count_ = 0;
};

/// Scale and bias of a material's parallax: as asked, or both made smaller so that the steepest look, which
/// moves a sample by scale / 2 + |bias|, stays within the limit.
glm::vec2 parallax_of(const assets::Material &material);

/// The coarsest level whose error, seen from `distance_m`, covers no more than `error_px` pixels.
/// errors_m: level 0 first, growing. Returns 0 when none is coarse enough.
int choose_lod(std::span<const float> errors_m, float distance_m, float pixels_at_1m, float error_px);

} // namespace paradize
