#pragma once
// Device memory of meshes and terrain patches. Blocks (levels of a mesh, neighbouring patches) share buffers,
// so that one draw call draws many of them.

#include "assets/glb.hpp"
#include "assets/upload_plan.hpp"
#include "gl/handle.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace paradize {

/// How vertices and indices lie in a buffer. Blocks of one layout may share buffers.
struct GeometryLayout {
    std::array<std::size_t, assets::mesh_attributes> vertex_bytes{}; // of each attribute; 0: there is none
    std::array<assets::GlbFormat, assets::mesh_attributes> formats{};
    std::size_t index_bytes = 2;

    std::uint64_t bytes(std::size_t vertices, std::size_t indices) const;
    unsigned index_type() const; // GL_UNSIGNED_SHORT or GL_UNSIGNED_INT
    bool operator==(const GeometryLayout &) const = default;
};

struct GeometryPage;

/// Where the vertices and indices of a block lie. The pool may move them when another block is freed.
struct GeometrySlot {
    GeometryPage *page = nullptr; // nullptr: the block has no memory
    std::size_t first_vertex = 0, vertices = 0, first_index = 0, indices = 0;
    GeometrySlot *next = nullptr; // of the page
};

/// Buffers with the vertex array that draws from them.
struct GeometryPage {
    std::uint32_t id = 0; // no other page of its pool has it; a later page has a larger one
    GeometryLayout layout;
    gl::VertexArray vertex_array;
    gl::Buffer vertices, indices;
    std::array<std::size_t, assets::mesh_attributes> attribute_offsets{}; // in the vertex buffer, bytes
    std::size_t vertex_count = 0, index_count = 0;
    GeometrySlot *first = nullptr; // its blocks, in the order of their vertices and of their indices
    std::uint64_t bytes = 0, used_bytes = 0;
};

class GeometryPool {
  public:
    /// Blocks of up to half of `page_bytes` share pages of this size, as long as no more than
    /// `slack_bytes` of all pages are unused. Other blocks have pages of their own, of their size.
    GeometryPool(std::uint64_t page_bytes, std::uint64_t slack_bytes)
        : page_bytes_(page_bytes), slack_bytes_(slack_bytes) {}

    /// Allocates what so many more blocks need, so that take() and release() allocate nothing but device
    /// memory.
    void reserve(std::size_t blocks);
    /// Says that a block of this layout will be taken and not be released before the others. Pages of a
    /// layout that is expected are as large as all its expected blocks, whatever the constructor was told.
    void expect(const GeometryLayout &layout, std::size_t vertices, std::size_t indices);
    /// Takes memory for a block, with undefined content. The slot stays where it is until release().
    /// `indices_per_vertex` of all blocks of its layout sizes the pages.
    void take(GeometrySlot &slot, const GeometryLayout &layout, std::size_t vertices, std::size_t indices,
              double indices_per_vertex);
    /// Frees a block's memory. Where too much is unused then, it moves the blocks of sparse pages into
    /// others.
    void release(GeometrySlot &slot);

    std::uint64_t bytes() const { return bytes_; }                      // on the device
    std::uint64_t unused_bytes() const { return bytes_ - used_bytes_; } // part of them
    std::size_t pages() const { return pages_.size(); }

  private:
    struct Expected {
        GeometryLayout layout;
        std::size_t vertices = 0, indices = 0;
    };

    bool place_in_any(GeometrySlot &slot, const GeometryLayout &layout, const GeometryPage *except);
    GeometryPage &open(const GeometryLayout &layout, std::size_t vertices, std::size_t indices);
    void close(GeometryPage &page);
    bool empty_sparsest();

    std::uint64_t page_bytes_, slack_bytes_;
    std::uint64_t bytes_ = 0, used_bytes_ = 0;
    std::uint32_t next_id_ = 0;                                 // of pages
    std::vector<Expected> expected_;                            // of layouts that have no page yet
    std::vector<std::unique_ptr<GeometryPage>> pages_, closed_; // closed: without buffers, to be opened again
};

} // namespace paradize
