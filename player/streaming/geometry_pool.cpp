#include "streaming/geometry_pool.hpp"

#include "gl/buffer.hpp"
#include "streaming/streamed_mesh.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <utility>

namespace paradize {

namespace {

constexpr std::uint64_t blocks_per_page = 2; // at least, of pages that blocks share

void copy_slot(const GeometrySlot &from, const GeometrySlot &to) {
    const GeometryLayout &layout = from.page->layout;
    for (std::size_t part = 0; part < layout.vertex_bytes.size(); ++part) {
        const std::size_t bytes = layout.vertex_bytes[part];
        if (bytes != 0) {
            gl::copy_buffer(from.page->vertices,
                            from.page->attribute_offsets[part] + from.first_vertex * bytes, to.page->vertices,
                            to.page->attribute_offsets[part] + to.first_vertex * bytes,
                            from.vertices * bytes);
        }
    }
    gl::copy_buffer(from.page->indices, from.first_index * layout.index_bytes, to.page->indices,
                    to.first_index * layout.index_bytes, from.indices * layout.index_bytes);
}

} // namespace

std::uint64_t GeometryLayout::bytes(std::size_t vertices, std::size_t indices) const {
    return vertices * std::accumulate(vertex_bytes.begin(), vertex_bytes.end(), std::size_t{0}) +
           indices * index_bytes;
}

unsigned GeometryLayout::index_type() const {
    return index_bytes == 2 ? GL_UNSIGNED_SHORT : GL_UNSIGNED_INT;
}

namespace {

GeometryPage make_page(const GeometryLayout &layout, std::size_t vertex_count, std::size_t index_count) {
    GeometryPage page;
    page.layout = layout;
    page.vertex_count = vertex_count;
    page.index_count = index_count;
    page.bytes = layout.bytes(vertex_count, index_count);
    std::size_t end = 0;
    for (std::size_t part = 0; part < page.attribute_offsets.size(); ++part) {
        page.attribute_offsets[part] = end;
        end = attribute_end(end, vertex_count * layout.vertex_bytes[part]);
    }
    page.vertex_array = gl::VertexArray::create();
    glBindVertexArray(page.vertex_array.name());
    page.vertices = gl::make_buffer(GL_ARRAY_BUFFER, end, gl::Usage::fixed);
    for (std::uint32_t part = 0; part < page.attribute_offsets.size(); ++part) {
        if (layout.vertex_bytes[part] != 0) {
            attach_attribute(layout.formats[part], part, page.vertices, page.attribute_offsets[part]);
        }
    }
    page.indices =
        gl::make_buffer(GL_ELEMENT_ARRAY_BUFFER, index_count * layout.index_bytes, gl::Usage::fixed);
    glBindVertexArray(0);
    return page;
}

/// Finds the first gap between the page's blocks that the slot fits; false: there is none.
bool place(GeometrySlot &slot, GeometryPage &page) {
    std::size_t vertex = 0; // where the gap begins
    std::size_t index = 0;
    for (GeometrySlot **link = &page.first;; link = &(*link)->next) {
        GeometrySlot *const after = *link;
        const std::size_t last_vertex = after != nullptr ? after->first_vertex : page.vertex_count;
        const std::size_t last_index = after != nullptr ? after->first_index : page.index_count;
        if (last_vertex - vertex >= slot.vertices && last_index - index >= slot.indices) {
            slot.page = &page;
            slot.first_vertex = vertex;
            slot.first_index = index;
            slot.next = after;
            *link = &slot;
            page.used_bytes += page.layout.bytes(slot.vertices, slot.indices);
            return true;
        }
        if (after == nullptr) {
            return false;
        }
        vertex = after->first_vertex + after->vertices;
        index = after->first_index + after->indices;
    }
}

/// Frees the slot's room in its page.
void remove(GeometrySlot &slot) {
    GeometryPage &page = *slot.page;
    GeometrySlot **link = &page.first;
    while (*link != &slot) {
        link = &(*link)->next;
    }
    *link = std::exchange(slot.next, nullptr);
    slot.page = nullptr;
    page.used_bytes -= page.layout.bytes(slot.vertices, slot.indices);
}

} // namespace

void GeometryPool::reserve(std::size_t blocks) {
    const std::size_t pages = pages_.size() + closed_.size() + blocks; // each block may have its own
    pages_.reserve(pages);
    closed_.reserve(pages);
    for (std::size_t i = 0; i < blocks; ++i) {
        closed_.push_back(std::make_unique<GeometryPage>());
    }
}

void GeometryPool::expect(const GeometryLayout &layout, std::size_t vertices, std::size_t indices) {
    const auto known = std::ranges::find(expected_, layout, &Expected::layout);
    if (known == expected_.end()) {
        expected_.push_back({layout, vertices, indices});
    } else {
        known->vertices += vertices;
        known->indices += indices;
    }
}

bool GeometryPool::place_in_any(GeometrySlot &slot, const GeometryLayout &layout,
                                const GeometryPage *except) {
    return std::ranges::any_of(pages_, [&](const std::unique_ptr<GeometryPage> &page) {
        return page.get() != except && page->layout == layout && place(slot, *page);
    });
}

GeometryPage &GeometryPool::open(const GeometryLayout &layout, std::size_t vertices, std::size_t indices) {
    if (closed_.empty()) {
        reserve(1);
    }
    pages_.push_back(std::move(closed_.back()));
    closed_.pop_back();
    GeometryPage &page = *pages_.back();
    page = make_page(layout, vertices, indices);
    page.id = next_id_++;
    bytes_ += page.bytes;
    return page;
}

void GeometryPool::close(GeometryPage &page) {
    bytes_ -= page.bytes;
    page = GeometryPage();
    const auto at = std::ranges::find(pages_, &page, &std::unique_ptr<GeometryPage>::get);
    closed_.push_back(std::move(*at));
    pages_.erase(at);
}

void GeometryPool::take(GeometrySlot &slot, const GeometryLayout &layout, std::size_t vertices,
                        std::size_t indices, double indices_per_vertex) {
    slot.vertices = vertices;
    slot.indices = indices;
    const std::uint64_t bytes = layout.bytes(vertices, indices);
    if (!place_in_any(slot, layout, nullptr)) {
        const bool shares = bytes * blocks_per_page <= page_bytes_ &&
                            bytes_ - used_bytes_ + page_bytes_ - bytes <= slack_bytes_;
        std::size_t page_vertices = vertices;
        std::size_t page_indices = indices;
        const auto expected = std::ranges::find(expected_, layout, &Expected::layout);
        if (expected != expected_.end()) {
            page_vertices = std::max(vertices, expected->vertices);
            page_indices = std::max(indices, expected->indices);
            expected_.erase(expected);
        } else if (shares) {
            const double vertex_bytes = static_cast<double>(layout.bytes(1, 0)) +
                                        indices_per_vertex * static_cast<double>(layout.index_bytes);
            const double count = static_cast<double>(page_bytes_) / vertex_bytes;
            page_vertices = std::max(vertices, static_cast<std::size_t>(count));
            page_indices = std::max(indices, static_cast<std::size_t>(count * indices_per_vertex));
        }
        place(slot, open(layout, page_vertices, page_indices));
    }
    used_bytes_ += bytes;
}

void GeometryPool::release(GeometrySlot &slot) {
    GeometryPage &page = *slot.page;
    used_bytes_ -= page.layout.bytes(slot.vertices, slot.indices);
    remove(slot);
    if (page.used_bytes == 0) {
        close(page);
    }
    while (unused_bytes() > slack_bytes_ && empty_sparsest()) {
    }
}

/// Moves the blocks of the page that has most unused bytes into other pages, and deletes it. False: they do
/// not fit there; those that do have moved.
bool GeometryPool::empty_sparsest() {
    const auto sparsest = std::ranges::max_element(
        pages_, {}, [](const std::unique_ptr<GeometryPage> &page) { return page->bytes - page->used_bytes; });
    GeometryPage &page = **sparsest;
    while (page.first != nullptr) {
        GeometrySlot &slot = *page.first;
        const GeometrySlot before = slot;
        remove(slot);
        if (!place_in_any(slot, page.layout, &page)) {
            slot = before; // where it was, because nothing was copied
            page.first = &slot;
            page.used_bytes += page.layout.bytes(slot.vertices, slot.indices);
            return false;
        }
        copy_slot(before, slot);
    }
    close(page);
    return true;
}

} // namespace paradize
