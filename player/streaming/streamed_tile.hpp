#pragma once
// One terrain tile on the GPU: blocks of neighbouring patches, in the memory of a GeometryPool.

#include "assets/glb.hpp"
#include "assets/upload_plan.hpp"
#include "gl/buffer.hpp"
#include "streaming/geometry_pool.hpp"

#include <glm/mat4x4.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace paradize {

/// The range of a patch in its block's memory.
struct PatchRange {
    std::uint32_t block = 0;
    int index_count = 0;
    std::size_t first_index = 0, first_vertex = 0; // from those of the block
    float low_m = 0.0F, high_m = 0.0F;             // world heights between which it lies
};

/// Patches that are loaded and evicted together: a piece of plan_patches().
struct TileBlock {
    std::uint32_t first_patch = 0, patches = 0;
    std::size_t vertices = 0, indices = 0;
    GeometrySlot slot; // without a page while the block is not loaded
    bool resident = false;
};

class StreamedTile {
  public:
    StreamedTile() = default;
    /// `glb.levels` are the patches, `pieces` the blocks. Creates no buffers yet. Throws Error if a patch
    /// differs from the first one in attributes or index type, or does not have exactly one primitive.
    StreamedTile(const assets::Glb &glb, std::span<const assets::Piece> pieces, const std::string &path,
                 std::shared_ptr<GeometryPool> pool);
    StreamedTile(StreamedTile &&) = default;
    StreamedTile &operator=(StreamedTile &&other) noexcept;
    ~StreamedTile();

    std::uint32_t size() const { return static_cast<std::uint32_t>(ranges_.size()); }
    const PatchRange &range(std::uint32_t patch) const { return ranges_[patch]; }
    std::span<const TileBlock> blocks() const { return blocks_; }
    const glm::dmat4 &model() const { return model_; } // world from mesh, for all patches

    /// Takes memory for a block, writes a chunk of plan_patches() into them, says that all are written.
    void begin(std::uint32_t block);
    void upload(const assets::Glb &glb, const assets::UploadChunk &chunk, const gl::Source &from);
    void finish(std::uint32_t block) { blocks_[block].resident = true; }
    /// Frees the memory of a block.
    void evict(std::uint32_t block);

  private:
    void release_all();

    std::shared_ptr<GeometryPool> pool_;
    GeometryLayout layout_;
    double indices_per_vertex_ = 0.0;
    std::vector<TileBlock> blocks_;
    std::vector<PatchRange> ranges_;
    glm::dmat4 model_{1.0};
};

} // namespace paradize
