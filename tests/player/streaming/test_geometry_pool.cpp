// Device memory of meshes and terrain patches: shared, moved, bounded.

#include "context.hpp"
#include "gl/buffer.hpp"
#include "scene/random.hpp"
#include "streaming/geometry_pool.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

using namespace paradize;

namespace {

GeometryLayout positions_and_normals() {
    GeometryLayout layout;
    layout.vertex_bytes[0] = layout.vertex_bytes[1] = 12;
    layout.formats[0].stride = layout.formats[1].stride = 12;
    return layout;
}

std::vector<std::byte> filled(std::size_t bytes, unsigned value) {
    return {bytes, static_cast<std::byte>(value)};
}

/// Writes a value into all of a block: its positions, normals and indices.
void fill(const GeometrySlot &slot, unsigned value) {
    for (const std::size_t part : {0U, 1U}) {
        gl::write_buffer(GL_COPY_WRITE_BUFFER, slot.page->vertices,
                         slot.page->attribute_offsets[part] + slot.first_vertex * 12,
                         filled(slot.vertices * 12, value + static_cast<unsigned>(part)));
    }
    gl::write_buffer(GL_COPY_WRITE_BUFFER, slot.page->indices, slot.first_index * 2,
                     filled(slot.indices * 2, value + 2));
}

bool holds(const gl::Buffer &buffer, std::size_t offset, std::size_t bytes, unsigned value) {
    std::vector<std::byte> read(bytes);
    glBindBuffer(GL_COPY_READ_BUFFER, buffer.name());
    glGetBufferSubData(GL_COPY_READ_BUFFER, static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(bytes),
                       read.data());
    return read == filled(bytes, value);
}

bool holds(const GeometrySlot &slot, unsigned value) {
    const GeometryPage &page = *slot.page;
    return holds(page.vertices, page.attribute_offsets[0] + slot.first_vertex * 12, slot.vertices * 12,
                 value) &&
           holds(page.vertices, page.attribute_offsets[1] + slot.first_vertex * 12, slot.vertices * 12,
                 value + 1) &&
           holds(page.indices, slot.first_index * 2, slot.indices * 2, value + 2);
}

} // namespace

TEST_CASE("geometry pool: small blocks share a page, large ones and other layouts have their own") {
    if (!test::have_context()) {
        return;
    }
    GeometryPool pool(1 << 16, 1 << 20);
    const GeometryLayout layout = positions_and_normals();
    GeometryLayout wide = layout;
    wide.index_bytes = 4;
    GeometrySlot a, b, large, other;
    pool.take(a, layout, 100, 300, 3.0);
    pool.take(b, layout, 100, 300, 3.0);
    pool.take(large, layout, 2000, 6000, 3.0);
    pool.take(other, wide, 100, 300, 3.0);
    CHECK(a.page == b.page);
    CHECK(large.page != a.page);
    CHECK(large.page->bytes == large.page->used_bytes);
    CHECK(other.page != a.page);
    for (GeometrySlot *slot : {&a, &b, &large, &other}) {
        pool.release(*slot);
        CHECK(slot->page == nullptr);
    }
    CHECK(pool.bytes() == 0);
    CHECK(pool.pages() == 0);
    GeometryPool tight(1 << 16, 1 << 10); // a page that is nearly empty exceeds the bound
    GeometrySlot alone;
    tight.take(alone, layout, 100, 300, 3.0);
    CHECK(tight.unused_bytes() == 0);
    tight.release(alone);
    test::throw_on_error();
}

TEST_CASE("geometry pool: unused memory stays within its bound, and blocks that move keep their bytes") {
    if (!test::have_context()) {
        return;
    }
    constexpr std::uint64_t page_bytes = 1 << 16;
    constexpr std::uint64_t slack_bytes = 3 * page_bytes;
    GeometryPool pool(page_bytes, slack_bytes);
    Pcg random(3);
    struct Block {
        std::unique_ptr<GeometrySlot> slot;
        unsigned value = 0; // of its bytes
        const GeometryPage *page = nullptr;
    };
    std::vector<Block> blocks;
    std::uint64_t largest_unused = 0;
    int moved = 0;
    for (unsigned step = 0; step < 900; ++step) {
        const bool grows = step / 100 % 2 == 0;
        if (random.next() % 4 < (grows ? 3U : 1U)) {
            const std::size_t vertices = 20 + random.next() % 300;
            Block block{std::make_unique<GeometrySlot>(), step % 250};
            const std::size_t per_vertex = 1 + random.next() % 5; // vertices or indices fill a page
            pool.take(*block.slot, positions_and_normals(), vertices, per_vertex * vertices, 3.0);
            fill(*block.slot, step % 250);
            block.page = block.slot->page;
            blocks.push_back(std::move(block));
        } else if (!blocks.empty()) {
            std::swap(blocks[random.next() % blocks.size()], blocks.back());
            pool.release(*blocks.back().slot);
            blocks.pop_back();
            for (Block &block : blocks) {
                if (std::exchange(block.page, block.slot->page) != block.slot->page) {
                    ++moved;
                    CHECK(holds(*block.slot, block.value));
                }
            }
        }
        largest_unused = std::max(largest_unused, pool.unused_bytes());
    }
    CHECK(largest_unused <= slack_bytes);
    CHECK(moved > 0);
    CHECK(pool.pages() < blocks.size() / 3); // most share
    CHECK(std::ranges::all_of(blocks, [](const Block &block) { return holds(*block.slot, block.value); }));
    test::throw_on_error();
}

TEST_CASE(
    "geometry pool: where the blocks of the sparsest page fit no other page they stay with their bytes") {
    if (!test::have_context()) {
        return;
    }
    GeometryPool pool(1 << 16, 60000); // pages of 2184 vertices
    const GeometryLayout layout = positions_and_normals();
    GeometrySlot small[2], large[2];
    for (const std::size_t i : {0U, 1U}) {
        pool.take(small[i], layout, 950, 2850, 3.0);
        pool.take(large[i], layout, 1150, 3450, 3.0);
        REQUIRE(small[i].page == large[i].page);
        fill(large[i], 10 * static_cast<unsigned>(i));
    }
    GeometrySlot others[2];
    for (GeometrySlot &other : others) {
        pool.take(other, layout, 1050, 3150, 3.0);
    }
    pool.release(small[0]);
    pool.release(small[1]);
    CHECK(pool.unused_bytes() > 60000); // too much, but no block can move
    CHECK(pool.pages() == 3);
    CHECK(large[0].first_vertex == 950);
    CHECK(holds(large[0], 0));
    CHECK(holds(large[1], 10));
    GeometrySlot again; // its page is whole: the room before the block is still free
    pool.take(again, layout, 950, 2850, 3.0);
    CHECK(again.page == large[0].page);
    CHECK(again.first_vertex == 0);
    test::throw_on_error();
}

TEST_CASE("geometry pool: blocks that are expected share one page of exactly their size, layout by layout") {
    if (!test::have_context()) {
        return;
    }
    GeometryPool pool(0, std::numeric_limits<std::uint64_t>::max());
    const GeometryLayout layout = positions_and_normals();
    GeometryLayout wide = layout;
    wide.index_bytes = 4;
    GeometrySlot a, b, other, late;
    pool.expect(layout, 100, 300);
    pool.expect(wide, 50, 90);
    pool.expect(layout, 200, 33);
    pool.take(b, layout, 200, 33, 0.0);
    pool.take(other, wide, 50, 90, 0.0);
    pool.take(a, layout, 100, 300, 0.0);
    CHECK(a.page == b.page);
    CHECK(a.page != other.page);
    CHECK(pool.pages() == 2);
    CHECK(pool.unused_bytes() == 0);
    fill(a, 1);
    fill(b, 4);
    CHECK(holds(a, 1));
    CHECK(holds(b, 4));
    pool.take(late, layout, 10, 30, 0.0); // nobody expected it
    CHECK(late.page != a.page);
    CHECK(pool.unused_bytes() == 0);
    for (GeometrySlot *slot : {&a, &b, &other, &late}) {
        pool.release(*slot);
    }
    CHECK(pool.bytes() == 0);
}
