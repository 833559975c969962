#pragma once
// Device memory of terrain patches. Blocks of patches share buffers, so that one draw call draws patches of
// many blocks.

#include "assets/glb.hpp"
#include "assets/upload_plan.hpp"
#include "gl/handle.hpp"
#include "streaming/free_ranges.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace paradize {

/// How vertices and indices lie in a buffer. Blocks of one layout may share buffers.
struct PatchLayout {
    std::array<std::size_t, assets::mesh_attributes> vertex_bytes{}; // of each attribute; 0: there is none
    std::array<assets::GlbFormat, assets::mesh_attributes> formats{};
    std::size_t index_bytes = 2;

    std::uint64_t bytes(std::size_t vertices, std::size_t indices) const;
    bool operator==(const PatchLayout &) const = default;
};

/// Buffers with the vertex array that draws from them.
struct PatchPage {
    PatchPage(std::uint32_t page_id, const PatchLayout &of, std::size_t vertices, std::size_t indices);

    std::uint32_t id; // no other page of the process has it; a later page has a larger one
    PatchLayout layout;
    gl::VertexArray vertex_array;
    gl::Buffer vertices, indices;
    std::array<std::size_t, assets::mesh_attributes> attribute_offsets{}; // in the vertex buffer, bytes
    FreeRanges free_vertices, free_indices;
    std::uint64_t bytes, used_bytes = 0;
};

/// Where the vertices and indices of a block lie. The pool may move them when another block is freed.
struct PatchSlot {
    PatchPage *page = nullptr;
    std::size_t first_vertex = 0, vertices = 0, first_index = 0, indices = 0;
};

class PatchPool {
  public:
    /// Blocks of up to half of `page_bytes` share pages of this size, as long as no more than
    /// `slack_bytes` of all pages are unused. Other blocks have pages of their own, of their size.
    PatchPool(std::uint64_t page_bytes, std::uint64_t slack_bytes)
        : page_bytes_(page_bytes), slack_bytes_(slack_bytes) {}

    /// Returns memory for a block, with undefined content. The pointer is valid until release().
    /// `indices_per_vertex` of all blocks of its layout sizes the pages.
    const PatchSlot *take(const PatchLayout &layout, std::size_t vertices, std::size_t indices,
                          double indices_per_vertex);
    /// Frees a block's memory. Where too much is unused then, it moves the blocks of sparse pages into
    /// others.
    void release(const PatchSlot *slot);

    std::uint64_t bytes() const { return bytes_; }                      // on the device
    std::uint64_t unused_bytes() const { return bytes_ - used_bytes_; } // part of them
    std::size_t pages() const { return pages_.size(); }

  private:
    bool place(PatchSlot &slot, PatchPage &page);
    bool place_in_any(PatchSlot &slot, const PatchLayout &layout, const PatchPage *except);
    void remove(const PatchSlot &slot);
    void close(const PatchPage *page);
    bool empty_sparsest();

    std::uint64_t page_bytes_, slack_bytes_;
    std::uint64_t bytes_ = 0, used_bytes_ = 0;
    std::vector<std::unique_ptr<PatchPage>> pages_;
    std::vector<std::unique_ptr<PatchSlot>> slots_;
};

} // namespace paradize
