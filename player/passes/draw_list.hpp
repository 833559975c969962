#pragma once
// The objects that a view draws: draw calls in an order that changes little state, and the transforms of
// their instances. Uses no GL.

#include "scene/view.hpp"
#include "streaming/scene.hpp"

#include <glm/vec3.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace paradize {

/// The transforms of all instances relative to the views' anchor.
class InstanceTransforms {
  public:
    /// `objects` must outlive this. Reserves all memory.
    explicit InstanceTransforms(std::span<const Object> objects);

    /// Finds the transforms anew: of all if the anchor is another one, every 1024 m of the way
    /// (scene/camera.hpp); else of what moves.
    void update(const glm::dvec3 &anchor);
    std::span<const InstanceRows> of(const DrawItem &item) const;

  private:
    std::span<const Object> objects_;
    std::vector<std::uint32_t> first_; // by object
    std::vector<InstanceRows> rows_;
    glm::dvec3 anchor_;
};

/// Which materials a list holds: opaque ones and those with holes; blended ones; all.
enum class DrawnMaterials { solid, blended, all };

/// Draws the triangles of one material, in instances that share a level of detail, a winding and their
/// lights.
struct DrawCommand {
    const Object *object = nullptr;
    std::uint32_t material = 0; // index into Object::materials
    int lod = 0;
    bool mirrored = false;   // the winding of the triangles is reversed
    std::uint32_t first = 0; // of the list's instances
    std::uint32_t count = 0;
    std::uint32_t light_set = 0; // of the scene; 0: none of its lights is on
};

class DrawList {
  public:
    /// `objects` must outlive the list. Reserves all memory that fill() needs.
    DrawList(std::span<const Object> objects, DrawnMaterials drawn);

    /// Lists what `view` draws of its visible instances. Blended materials come back to front, by the centre
    /// of their triangles in each instance. All others come by program, material, lights, mesh and level, as
    /// this changes the least state; shadows need less of a material (Material::shadow_id). The work is that
    /// of the items and of copying their transforms, and of single instances where lights that are on reach
    /// the object. `lit`: of each light set of the scene the one that it is drawn as, 0: without lights;
    /// empty: all without.
    void fill(std::span<const DrawItem> items, const View &view, const InstanceTransforms &transforms,
              std::span<const std::uint32_t> lit = {});

    std::span<const DrawCommand> commands() const { return commands_; }
    std::size_t most_commands() const { return commands_.capacity(); }
    /// Number of instances, and their transforms in the order of the commands. `rows` has room for them; what
    /// fill() was given must still be there.
    std::size_t instance_count() const { return instance_count_; }
    void write_instances(std::span<InstanceRows> rows);
    std::size_t index_of(const Object &object) const {
        return static_cast<std::size_t>(&object - objects_.data());
    }

  private:
    /// Instances of an object at one level, with one winding and one set of lights.
    struct Group {
        const Object *object = nullptr;
        int lod = 0;
        bool mirrored = false;
        std::uint32_t light_set = 0;
        std::uint32_t count = 0, first = 0, filled = 0; // instances; the first one in the list
    };
    struct Blended {
        std::uint32_t item = 0, instance = 0, material = 0;
        float distance = 0.0F; // from the eye, metres
    };

    bool has(const Material &material) const;
    /// Finds light_as_.
    void find_lights();
    /// The light set of the scene that it is drawn as.
    std::uint32_t drawn_set(std::uint32_t set) const { return lit_.empty() ? 0 : lit_[set]; }
    /// The index into Object::light_sets that an instance is drawn with.
    std::uint32_t light_of(const Object &object, const Instance &instance) const {
        return light_as_[first_light_[index_of(object)] + instance.light];
    }
    Group &group_of(const DrawItem &item, std::uint32_t light);
    /// Calls take(group, first, count) for the parts of an item that share their lights.
    template <class Take>
    void for_each_part(const DrawItem &item, const Take &take);
    bool is_drawn(const DrawItem &item) const;
    void fill_sorted();
    void fill_blended(const View &view);

    std::span<const Object> objects_;
    DrawnMaterials drawn_;
    // of this fill
    std::span<const DrawItem> items_;
    const InstanceTransforms *transforms_ = nullptr;
    std::span<const std::uint32_t> lit_;
    std::size_t instance_count_ = 0;
    std::vector<std::uint32_t> first_light_; // by object
    std::vector<std::uint32_t> light_as_;    // by entry of Object::light_sets: the first that is drawn alike
    std::vector<std::uint32_t> first_group_; // by object
    std::vector<Group> groups_;              // two for each level and set of lights
    std::vector<Blended> blended_;
    std::vector<DrawCommand> commands_;
};

} // namespace paradize
