#pragma once
// The objects that a view draws: draw calls in an order that changes little state, and the transforms of
// all instances. Uses no GL.

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
    /// (scene/camera.hpp); else of what moves. True: of all.
    bool update(const glm::dvec3 &anchor);
    /// Object by object, instance by instance.
    std::span<const InstanceRows> rows() const { return rows_; }
    /// Index into rows() of an object's first instance.
    std::uint32_t first_of(const Object &object) const {
        return first_[static_cast<std::size_t>(&object - objects_.data())];
    }

  private:
    std::span<const Object> objects_;
    std::vector<std::uint32_t> first_; // by object
    std::vector<InstanceRows> rows_;
    glm::dvec3 anchor_;
};

/// Which materials a list holds: opaque ones and those with holes; blended ones; all.
enum class DrawnMaterials { solid, blended, all };

/// Neighbours in InstanceTransforms::rows().
struct RowRange {
    std::uint32_t first = 0, count = 0;
};

/// Draws the triangles of one material, in instances that share a level of detail, a winding and a block of
/// light sets.
struct DrawCommand {
    const Object *object = nullptr;
    std::uint32_t material = 0; // index into Object::materials
    int lod = 0;
    bool mirrored = false;  // the winding of the triangles is reversed
    bool by_lights = false; // a light set of the object is lit
    std::uint32_t light_block = 0;
    std::uint32_t first = 0, count = 0;             // of the list's instances
    std::uint32_t first_range = 0, range_count = 0; // the same as ranges of rows
};

class DrawList {
  public:
    /// `objects` must outlive the list. Reserves all memory that fill() needs. `sets_per_block`:
    /// light_sets_per_block().
    DrawList(std::span<const Object> objects, DrawnMaterials drawn, std::uint32_t sets_per_block = 1);

    /// Lists what `view` draws of its visible instances. Blended materials come back to front, by the centre
    /// of their triangles in each instance. All others come by program, material, lights, mesh and level, as
    /// this changes the least state; shadows need less of a material (Material::shadow_id). The work is that
    /// of the items, and of single instances where lights of several blocks reach the object. `lit`: by light
    /// set of the scene, as in PointLights; empty: none is.
    void fill(std::span<const DrawItem> items, const View &view, const InstanceTransforms &transforms,
              std::span<const std::uint8_t> lit = {});

    std::span<const DrawCommand> commands() const { return commands_; }
    std::size_t most_commands() const { return commands_.capacity(); }
    std::span<const RowRange> ranges_of(const DrawCommand &command) const {
        return std::span(ranges_).subspan(command.first_range, command.range_count);
    }
    /// Number of instances. Copies their transforms, for devices where one draw takes one range: `out` has
    /// room for them.
    std::size_t instance_count() const { return instance_count_; }
    void write_instances(std::span<const InstanceRows> rows, std::span<InstanceRows> out) const;
    std::size_t index_of(const Object &object) const {
        return static_cast<std::size_t>(&object - objects_.data());
    }

  private:
    /// Instances of an object at one level, with one winding and one block of light sets.
    struct Group {
        const Object *object = nullptr;
        int lod = 0;
        bool mirrored = false;
        std::uint32_t light_block = 0;
        std::uint32_t count = 0;           // instances
        std::uint32_t ranges = 0, end = 0; // of ranges_; the end of those that are there
    };
    struct Blended {
        std::uint32_t item = 0, instance = 0, material = 0;
        float distance = 0.0F; // from the eye, metres
    };

    bool has(const Material &material) const;
    bool is_lit(const Object &object) const;
    std::uint32_t block_of(const Object &object, const Instance &instance) const {
        return object.light_sets[instance.light] / sets_per_block_;
    }
    /// Calls take(group, first, count) for the parts of an item that share their block.
    template <class Take>
    void for_each_part(const DrawItem &item, const Take &take);
    bool is_drawn(const DrawItem &item) const;
    void fill_sorted();
    void fill_blended(const View &view);

    std::span<const Object> objects_;
    DrawnMaterials drawn_;
    std::uint32_t sets_per_block_;
    // of this fill
    std::span<const DrawItem> items_;
    const InstanceTransforms *transforms_ = nullptr;
    std::span<const std::uint8_t> lit_;
    std::size_t instance_count_ = 0;
    std::vector<std::uint32_t> first_group_; // by object, plus the end
    std::vector<Group> groups_;              // two for each level and block
    std::vector<RowRange> ranges_;
    std::vector<Blended> blended_;
    std::vector<DrawCommand> commands_;
};

} // namespace paradize
