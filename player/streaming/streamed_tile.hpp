#pragma once
// One terrain tile on the GPU: blocks of neighbouring patches that share a vertex array.

#include "assets/glb.hpp"
#include "assets/upload_plan.hpp"
#include "gl/handle.hpp"

#include <glm/mat4x4.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace paradize {

/// The range of a patch in its block's buffers.
struct PatchRange {
    std::uint32_t block = 0;
    int index_count = 0;
    std::size_t index_offset = 0; // bytes
    int base_vertex = 0;
    float low_m = 0.0F, high_m = 0.0F; // world heights between which it lies
};

/// Patches that are loaded and evicted together: a piece of plan_patches().
struct TileBlock {
    std::uint32_t first_patch = 0, patches = 0;
    gl::VertexArray vertex_array; // empty, like the buffers, while the block is not loaded
    gl::Buffer vertices, indices;
    std::array<std::size_t, assets::mesh_attributes> attribute_offsets{}; // in the vertex buffer, bytes
    std::size_t vertex_bytes = 0, index_bytes = 0;
    bool resident = false;
};

class StreamedTile {
  public:
    StreamedTile() = default;
    /// `glb.levels` are the patches, `pieces` the blocks. Creates no buffers yet. Throws Error if a patch
    /// differs from the first one in attributes or index type, or does not have exactly one primitive.
    StreamedTile(const assets::Glb &glb, std::span<const assets::Piece> pieces, const std::string &path);

    std::uint32_t size() const { return static_cast<std::uint32_t>(ranges_.size()); }
    const PatchRange &range(std::uint32_t patch) const { return ranges_[patch]; }
    std::span<const TileBlock> blocks() const { return blocks_; }
    unsigned index_type() const { return index_type_; }
    const glm::dmat4 &model() const { return model_; } // world from mesh, for all patches

    /// Creates the buffers of a block, writes a chunk of plan_patches() into them, says that all are written.
    void begin(const assets::Glb &glb, std::uint32_t block);
    void upload(const assets::Glb &glb, const assets::UploadChunk &chunk, const std::byte *bytes);
    void finish(std::uint32_t block) { blocks_[block].resident = true; }
    /// Deletes the buffers of a block.
    void evict(std::uint32_t block);

  private:
    std::vector<TileBlock> blocks_;
    std::vector<PatchRange> ranges_;
    glm::dmat4 model_{1.0};
    unsigned index_type_ = 0;
};

} // namespace paradize
