#pragma once
// An object's mesh on the GPU: one vertex array per level of detail.

#include "assets/glb.hpp"
#include "assets/upload_plan.hpp"
#include "gl/handle.hpp"

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace paradize {

/// A range of triangles with one material.
struct MeshPrimitive {
    int material = 0; // index into StreamedMesh::materials()
    int index_count = 0;
    std::size_t index_offset = 0; // bytes into the level's index buffer
};

struct MeshLevel {
    gl::VertexArray vertex_array; // empty, like the buffers, while the level is not loaded
    gl::Buffer vertices, indices;
    std::size_t vertex_bytes = 0, index_bytes = 0;
    unsigned index_type = 0; // GL_UNSIGNED_SHORT or GL_UNSIGNED_INT
    std::vector<MeshPrimitive> primitives;
    bool has_uv1 = false;
    bool resident = false;
};

class StreamedMesh {
  public:
    StreamedMesh() = default;
    /// Creates no buffers yet.
    explicit StreamedMesh(const assets::Glb &glb);

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
    /// Binds a level whose instances start at entry `first` of `instances`: InstanceRows.
    void bind(int level, const gl::Buffer &instances, std::size_t first) const;
    /// Draws all primitives of a material in the level that is bound.
    void draw(int level, std::size_t material, int instances) const;

    /// Creates the buffers of a level, writes a chunk of plan_mesh() into them, says that all are written.
    void begin(const assets::Glb &glb, std::uint32_t level);
    void upload(const assets::UploadChunk &chunk, const std::byte *bytes);
    void finish(std::uint32_t level) { levels_[level].resident = true; }
    /// Deletes the buffers of a level.
    void evict(std::uint32_t level);

  private:
    std::vector<MeshLevel> levels_;
    std::vector<std::string> materials_;
    std::vector<assets::MaterialMeasure> measures_; // one per material
    assets::QuantisationGrid grid_;
    glm::vec3 low_{std::numeric_limits<float>::infinity()}, high_{-std::numeric_limits<float>::infinity()};
    std::vector<std::vector<std::size_t>> offsets_; // per level and part, offset in its buffer in bytes
};

/// Returns the matrix from quantised values to metres.
glm::dmat4 model_of(const assets::QuantisationGrid &grid);
/// Enables attribute `part` of the bound vertex array, read from `vertices` at `offset_bytes`.
void attach_attribute(const assets::GlbFormat &format, std::uint32_t part, const gl::Buffer &vertices,
                      std::size_t offset_bytes);
/// Returns the aligned offset of the next attribute.
std::size_t attribute_end(std::size_t offset_bytes, std::size_t bytes);

} // namespace paradize
