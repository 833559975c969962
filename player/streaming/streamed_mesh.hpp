#pragma once
// An object's mesh on the GPU: levels of detail in the memory of a GeometryPool.

#include "assets/glb.hpp"
#include "assets/upload_plan.hpp"
#include "gl/buffer.hpp"
#include "gl/draw.hpp"
#include "streaming/geometry_pool.hpp"

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace paradize {

/// A range of triangles with one material.
struct MeshPrimitive {
    int material = 0; // index into StreamedMesh::materials()
    std::uint32_t index_count = 0;
    std::uint32_t first_index = 0; // of the level
};

struct MeshLevel {
    std::string node; // its name in the GLB
    GeometryLayout layout;
    GeometrySlot slot; // without a page while the level is not loaded
    std::size_t vertices = 0, indices = 0;
    std::vector<MeshPrimitive> primitives;
    bool has_uv1 = false;
    bool resident = false;
};

class StreamedMesh {
  public:
    StreamedMesh() = default;
    /// Takes no memory yet.
    StreamedMesh(const assets::Glb &glb, std::shared_ptr<GeometryPool> pool);
    StreamedMesh(StreamedMesh &&) = default;
    StreamedMesh &operator=(StreamedMesh &&other) noexcept;
    ~StreamedMesh();

    std::span<const MeshLevel> levels() const { return levels_; } // level 0, the finest, comes first
    std::span<const std::string> materials() const { return materials_; }
    /// The quantisation grid of the positions. Its step is the same along all axes.
    const assets::QuantisationGrid &grid() const { return grid_; }
    /// The corners of the box around the positions of all levels, on the grid.
    const glm::vec3 &low() const { return low_; }
    const glm::vec3 &high() const { return high_; }
    /// Returns the resident level nearest to `wanted`; coarser levels are preferred. -1 if none is resident.
    int best_level(int wanted) const;
    const assets::MaterialMeasure &measure(std::size_t material) const { return measures_[material]; }
    /// The buffers of a resident level.
    const GeometryPage &page(int level) const { return *levels_[static_cast<std::size_t>(level)].slot.page; }
    /// Calls take(gl::IndirectDraw) for each primitive of a material in a resident level, for one instance.
    template <class Take>
    void for_each_draw(int level, std::uint32_t material, const Take &take) const {
        const MeshLevel &mesh = levels_[static_cast<std::size_t>(level)];
        for (const MeshPrimitive &primitive : mesh.primitives) {
            if (primitive.material == static_cast<int>(material)) {
                take(gl::IndirectDraw{primitive.index_count, 1,
                                      static_cast<std::uint32_t>(mesh.slot.first_index) +
                                          primitive.first_index,
                                      static_cast<std::int32_t>(mesh.slot.first_vertex), 0});
            }
        }
    }

    /// Tells the pool that all levels will be loaded and none evicted.
    void expect() const;
    /// Takes memory for a level, writes a chunk of plan_mesh() into it, says that all are written.
    void begin(std::uint32_t level);
    void upload(const assets::UploadChunk &chunk, const gl::Source &from);
    void finish(std::uint32_t level) { levels_[level].resident = true; }
    /// Frees the memory of a level.
    void evict(std::uint32_t level);

  private:
    void release_all();

    std::shared_ptr<GeometryPool> pool_;
    std::vector<MeshLevel> levels_; // the pool keeps the addresses of their slots
    std::vector<std::string> materials_;
    std::vector<assets::MaterialMeasure> measures_; // one per material
    assets::QuantisationGrid grid_;
    glm::vec3 low_{std::numeric_limits<float>::infinity()}, high_{-std::numeric_limits<float>::infinity()};
};

/// Binds the vertex array of a page, whose instances start at entry `first` of `instances`: InstanceRows.
void bind_page(const GeometryPage &page, const gl::Buffer &instances, std::size_t first);
/// Returns the matrix from quantised values to metres.
glm::dmat4 model_of(const assets::QuantisationGrid &grid);
/// Enables attribute `part` of the bound vertex array, read from `vertices` at `offset_bytes`.
void attach_attribute(const assets::GlbFormat &format, std::uint32_t part, const gl::Buffer &vertices,
                      std::size_t offset_bytes);
/// Returns the aligned offset of the next attribute.
std::size_t attribute_end(std::size_t offset_bytes, std::size_t bytes);

} // namespace paradize
