#include "streaming/patch_pool.hpp"

#include "gl/buffer.hpp"
#include "streaming/streamed_mesh.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <numeric>
#include <utility>

namespace paradize {

namespace {

constexpr std::uint64_t blocks_per_page = 2; // at least, of pages that blocks share

std::uint32_t next_id = 0; // all GL calls come from one thread

void copy_slot(const PatchSlot &from, const PatchSlot &to) {
    const PatchLayout &layout = from.page->layout;
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

std::uint64_t PatchLayout::bytes(std::size_t vertices, std::size_t indices) const {
    return vertices * std::accumulate(vertex_bytes.begin(), vertex_bytes.end(), std::size_t{0}) +
           indices * index_bytes;
}

PatchPage::PatchPage(std::uint32_t page_id, const PatchLayout &of, std::size_t vertex_count,
                     std::size_t index_count)
    : id(page_id), layout(of), free_vertices(vertex_count), free_indices(index_count),
      bytes(of.bytes(vertex_count, index_count)) {
    std::size_t end = 0;
    for (std::size_t part = 0; part < attribute_offsets.size(); ++part) {
        attribute_offsets[part] = end;
        end = attribute_end(end, vertex_count * layout.vertex_bytes[part]);
    }
    vertex_array = gl::VertexArray::create();
    glBindVertexArray(vertex_array.name());
    vertices = gl::make_buffer(GL_ARRAY_BUFFER, end, gl::Usage::fixed);
    for (std::uint32_t part = 0; part < attribute_offsets.size(); ++part) {
        if (layout.vertex_bytes[part] != 0) {
            attach_attribute(layout.formats[part], part, vertices, attribute_offsets[part]);
        }
    }
    indices = gl::make_buffer(GL_ELEMENT_ARRAY_BUFFER, index_count * layout.index_bytes, gl::Usage::fixed);
    glBindVertexArray(0);
}

/// Finds room for the slot in this page; false: it has none.
bool PatchPool::place(PatchSlot &slot, PatchPage &page) {
    const std::optional<std::size_t> first_vertex = page.free_vertices.take(slot.vertices);
    if (!first_vertex) {
        return false;
    }
    const std::optional<std::size_t> first_index = page.free_indices.take(slot.indices);
    if (!first_index) {
        page.free_vertices.give(*first_vertex, slot.vertices);
        return false;
    }
    slot.page = &page;
    slot.first_vertex = *first_vertex;
    slot.first_index = *first_index;
    page.used_bytes += page.layout.bytes(slot.vertices, slot.indices);
    return true;
}

bool PatchPool::place_in_any(PatchSlot &slot, const PatchLayout &layout, const PatchPage *except) {
    return std::ranges::any_of(pages_, [&](const std::unique_ptr<PatchPage> &page) {
        return page.get() != except && page->layout == layout && place(slot, *page);
    });
}

/// Frees the slot's room in its page.
void PatchPool::remove(const PatchSlot &slot) {
    PatchPage &page = *slot.page;
    page.free_vertices.give(slot.first_vertex, slot.vertices);
    page.free_indices.give(slot.first_index, slot.indices);
    page.used_bytes -= page.layout.bytes(slot.vertices, slot.indices);
}

void PatchPool::close(const PatchPage *page) {
    bytes_ -= page->bytes;
    std::erase_if(pages_, [&](const std::unique_ptr<PatchPage> &other) { return other.get() == page; });
}

const PatchSlot *PatchPool::take(const PatchLayout &layout, std::size_t vertices, std::size_t indices,
                                 double indices_per_vertex) {
    PatchSlot &slot = *slots_.emplace_back(std::make_unique<PatchSlot>());
    slot.vertices = vertices;
    slot.indices = indices;
    const std::uint64_t bytes = layout.bytes(vertices, indices);
    if (!place_in_any(slot, layout, nullptr)) {
        const bool shares = bytes * blocks_per_page <= page_bytes_ &&
                            bytes_ - used_bytes_ + page_bytes_ - bytes <= slack_bytes_;
        std::size_t page_vertices = vertices;
        std::size_t page_indices = indices;
        if (shares) {
            const double vertex_bytes = static_cast<double>(layout.bytes(1, 0)) +
                                        indices_per_vertex * static_cast<double>(layout.index_bytes);
            const double count = static_cast<double>(page_bytes_) / vertex_bytes;
            page_vertices = std::max(vertices, static_cast<std::size_t>(count));
            page_indices = std::max(indices, static_cast<std::size_t>(count * indices_per_vertex));
        }
        pages_.push_back(std::make_unique<PatchPage>(next_id++, layout, page_vertices, page_indices));
        bytes_ += pages_.back()->bytes;
        place(slot, *pages_.back());
    }
    used_bytes_ += bytes;
    return &slot;
}

void PatchPool::release(const PatchSlot *slot) {
    PatchPage *const page = slot->page;
    remove(*slot);
    used_bytes_ -= page->layout.bytes(slot->vertices, slot->indices);
    std::erase_if(slots_, [&](const std::unique_ptr<PatchSlot> &other) { return other.get() == slot; });
    if (page->used_bytes == 0) {
        close(page);
    }
    while (unused_bytes() > slack_bytes_ && empty_sparsest()) {
    }
}

/// Moves the blocks of the page that has most unused bytes into other pages, and deletes it. False: they do
/// not fit there; those that do have moved.
bool PatchPool::empty_sparsest() {
    const auto sparsest = std::ranges::max_element(
        pages_, {}, [](const std::unique_ptr<PatchPage> &page) { return page->bytes - page->used_bytes; });
    PatchPage *const page = sparsest->get();
    for (const std::unique_ptr<PatchSlot> &slot : slots_) {
        if (slot->page != page) {
            continue;
        }
        const PatchSlot before = *slot;
        if (!place_in_any(*slot, page->layout, page)) {
            return false;
        }
        copy_slot(before, *slot);
        remove(before);
    }
    close(page);
    return true;
}

} // namespace paradize
