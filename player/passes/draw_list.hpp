#pragma once
// What a view draws of the objects: draw calls in an order that changes little state, and the transforms of
// their instances. Uses no GL.

#include "scene/view.hpp"
#include "streaming/scene.hpp"

#include <glm/vec4.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace paradize {

/// Which materials a list holds: opaque ones and those with holes; blended ones; all.
enum class DrawnMaterials { solid, blended, all };

/// Draws the triangles of one material, in instances that share a level of detail and a winding.
struct DrawCommand {
    const Object *object = nullptr;
    std::uint32_t material = 0; // index into Object::materials
    int lod = 0;
    bool mirrored = false;   // the winding of the triangles is reversed
    std::uint32_t first = 0; // index into DrawList::instances()
    std::uint32_t count = 0;
};

/// Rows of the matrix from the mesh to the view's coordinates, as shaders/lib/model.glsl reads them.
using InstanceRows = std::array<glm::vec4, 3>;
static_assert(sizeof(InstanceRows) == 48);

class DrawList {
  public:
    /// `objects` must outlive the list. Reserves all memory that fill() needs.
    DrawList(std::span<const Object> objects, DrawnMaterials drawn);

    /// Lists what `view` draws of its visible instances. Blended materials come back to front, by the centre
    /// of their triangles in each instance. All others come by program, material, mesh and level, as this
    /// changes the least state.
    void fill(std::span<const DrawItem> items, const View &view);

    std::span<const DrawCommand> commands() const { return commands_; }
    std::span<const InstanceRows> instances() const { return instances_; }

  private:
    struct Blended {
        std::uint32_t item = 0, material = 0;
        float distance = 0.0F; // from the eye, metres
    };

    bool has(const Material &material) const;
    std::size_t index_of(const Object &object) const {
        return static_cast<std::size_t>(&object - objects_.data());
    }
    void add_instance(const DrawItem &item, const View &view);
    void fill_sorted(std::span<const DrawItem> items, const View &view);
    void fill_blended(std::span<const DrawItem> items, const View &view);

    std::span<const Object> objects_;
    DrawnMaterials drawn_;
    std::size_t most_commands_ = 0;
    std::vector<std::uint32_t> order_; // of items
    std::vector<Blended> blended_;
    std::vector<DrawCommand> commands_;
    std::vector<InstanceRows> instances_;
};

} // namespace paradize
