#pragma once
// One tile of the terrain on the GPU: all its patches in one vertex array.

#include "assets/glb.hpp"
#include "assets/upload_plan.hpp"
#include "gl/handle.hpp"

#include <glm/mat4x4.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace paradize {

/// A patch's triangles inside the tile's buffers.
struct PatchRange {
    int index_count = 0;
    std::size_t index_offset = 0; // bytes
    int base_vertex = 0;
};

class StreamedTile {
  public:
    StreamedTile() = default;
    /// Buffers for the patches `glb.levels`, in their order. Throws Error when one has other attributes or
    /// another index type than the first, no primitive, or more than one.
    StreamedTile(const assets::Glb &glb, const std::string &path);

    /// Patches that can be drawn: the first so many.
    std::uint32_t resident_patches() const { return resident_patches_; }
    std::uint32_t size() const { return static_cast<std::uint32_t>(ranges_.size()); }
    const PatchRange &range(std::uint32_t patch) const { return ranges_[patch]; }
    const gl::VertexArray &vertex_array() const { return vertex_array_; }
    unsigned index_type() const { return index_type_; }
    const glm::dmat4 &model() const { return model_; } // world from mesh, of all its patches

    /// Pieces come in the order of plan_patches().
    void upload(const assets::Glb &glb, const assets::UploadChunk &chunk);

  private:
    gl::VertexArray vertex_array_;
    gl::Buffer vertices_, indices_;
    std::vector<PatchRange> ranges_;
    std::vector<std::size_t> attribute_offsets_; // where each attribute of all patches begins, bytes
    glm::dmat4 model_{1.0};
    unsigned index_type_ = 0;
    std::uint32_t resident_patches_ = 0;
};

} // namespace paradize
