#pragma once
// One terrain tile on the GPU: all its patches share one vertex array.

#include "assets/glb.hpp"
#include "assets/upload_plan.hpp"
#include "gl/handle.hpp"

#include <glm/mat4x4.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace paradize {

/// The range of a patch in the tile's buffers.
struct PatchRange {
    int index_count = 0;
    std::size_t index_offset = 0; // bytes
    int base_vertex = 0;
};

class StreamedTile {
  public:
    StreamedTile() = default;
    /// Creates the buffers for the patches `glb.levels`, in their order. Throws Error if a patch differs from
    /// the first one in attributes or index type, or does not have exactly one primitive.
    StreamedTile(const assets::Glb &glb, const std::string &path);

    /// The number of patches that are resident. Patches become resident in order.
    std::uint32_t resident_patches() const { return resident_patches_; }
    std::uint32_t size() const { return static_cast<std::uint32_t>(ranges_.size()); }
    const PatchRange &range(std::uint32_t patch) const { return ranges_[patch]; }
    const gl::VertexArray &vertex_array() const { return vertex_array_; }
    unsigned index_type() const { return index_type_; }
    const glm::dmat4 &model() const { return model_; } // world from mesh, for all patches

    /// Uploads a chunk. Chunks must come in the order of plan_patches().
    void upload(const assets::Glb &glb, const assets::UploadChunk &chunk);

  private:
    gl::VertexArray vertex_array_;
    gl::Buffer vertices_, indices_;
    std::vector<PatchRange> ranges_;
    std::vector<std::size_t> attribute_offsets_; // offset of each attribute in the vertex buffer, bytes
    glm::dmat4 model_{1.0};
    unsigned index_type_ = 0;
    std::uint32_t resident_patches_ = 0;
};

} // namespace paradize
