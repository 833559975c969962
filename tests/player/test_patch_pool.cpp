// Device memory of terrain patches: shared, moved, bounded.

#include "context.hpp"
#include "gl/buffer.hpp"
#include "scene/random.hpp"
#include "streaming/patch_pool.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

using namespace paradize;

namespace {

PatchLayout positions_and_normals() {
    PatchLayout layout;
    layout.vertex_bytes[0] = layout.vertex_bytes[1] = 12;
    layout.formats[0].stride = layout.formats[1].stride = 12;
    return layout;
}

std::vector<std::byte> filled(std::size_t bytes, unsigned value) {
    return {bytes, static_cast<std::byte>(value)};
}

/// Writes a value into all of a block: its positions, normals and indices.
void fill(const PatchSlot &slot, unsigned value) {
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

bool holds(const PatchSlot &slot, unsigned value) {
    const PatchPage &page = *slot.page;
    return holds(page.vertices, page.attribute_offsets[0] + slot.first_vertex * 12, slot.vertices * 12,
                 value) &&
           holds(page.vertices, page.attribute_offsets[1] + slot.first_vertex * 12, slot.vertices * 12,
                 value + 1) &&
           holds(page.indices, slot.first_index * 2, slot.indices * 2, value + 2);
}

} // namespace

TEST_CASE("free ranges: what is taken never overlaps, and all that is given back can be taken as one") {
    FreeRanges ranges(1000);
    Pcg random(7);
    std::vector<std::pair<std::size_t, std::size_t>> taken;
    std::vector<bool> used(1000);
    for (int step = 0; step < 3000; ++step) {
        if (random.next() % 2 == 0) {
            const std::size_t count = 1 + random.next() % 60;
            if (const std::optional<std::size_t> first = ranges.take(count)) {
                REQUIRE(*first + count <= used.size());
                for (std::size_t i = *first; i < *first + count; ++i) {
                    REQUIRE_FALSE(used[i]);
                    used[i] = true;
                }
                taken.emplace_back(*first, count);
            }
        } else if (!taken.empty()) {
            std::swap(taken[random.next() % taken.size()], taken.back());
            const auto [first, count] = taken.back();
            taken.pop_back();
            std::fill_n(used.begin() + static_cast<std::ptrdiff_t>(first), count, false);
            ranges.give(first, count);
        }
    }
    for (const auto &[first, count] : taken) {
        ranges.give(first, count);
    }
    CHECK(ranges.take(1000) == std::optional<std::size_t>(0));
}

TEST_CASE("patch pool: small blocks share a page, large ones and other layouts have their own") {
    if (!test::have_context()) {
        return;
    }
    PatchPool pool(1 << 16, 1 << 20);
    const PatchLayout layout = positions_and_normals();
    const PatchSlot *const a = pool.take(layout, 100, 300, 3.0);
    const PatchSlot *const b = pool.take(layout, 100, 300, 3.0);
    const PatchSlot *const large = pool.take(layout, 2000, 6000, 3.0);
    PatchLayout wide = layout;
    wide.index_bytes = 4;
    const PatchSlot *const other = pool.take(wide, 100, 300, 3.0);
    CHECK(a->page == b->page);
    CHECK(large->page != a->page);
    CHECK(large->page->bytes == large->page->used_bytes);
    CHECK(other->page != a->page);
    for (const PatchSlot *slot : {a, b, large, other}) {
        pool.release(slot);
    }
    CHECK(pool.bytes() == 0);
    CHECK(pool.pages() == 0);
    PatchPool tight(1 << 16, 1 << 10); // a page that is nearly empty exceeds the bound
    const PatchSlot *const alone = tight.take(layout, 100, 300, 3.0);
    CHECK(tight.unused_bytes() == 0);
    tight.release(alone);
    test::throw_on_error();
}

TEST_CASE("patch pool: unused memory stays within its bound, and blocks that move keep their bytes") {
    if (!test::have_context()) {
        return;
    }
    constexpr std::uint64_t page_bytes = 1 << 16;
    constexpr std::uint64_t slack_bytes = 3 * page_bytes;
    PatchPool pool(page_bytes, slack_bytes);
    Pcg random(3);
    struct Block {
        const PatchSlot *slot = nullptr;
        unsigned value = 0; // of its bytes
        const PatchPage *page = nullptr;
    };
    std::vector<Block> blocks;
    std::uint64_t largest_unused = 0;
    int moved = 0;
    for (unsigned step = 0; step < 900; ++step) {
        const bool grows = step / 100 % 2 == 0;
        if (random.next() % 4 < (grows ? 3U : 1U)) {
            const std::size_t vertices = 20 + random.next() % 300;
            const PatchSlot *const slot = pool.take(positions_and_normals(), vertices, 3 * vertices, 3.0);
            fill(*slot, step % 250);
            blocks.push_back({slot, step % 250, slot->page});
        } else if (!blocks.empty()) {
            std::swap(blocks[random.next() % blocks.size()], blocks.back());
            pool.release(blocks.back().slot);
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
