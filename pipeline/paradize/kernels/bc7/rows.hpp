// A row of blocks, compiled once per instruction set: include after defining PARADIZE_WIDTH and
// PARADIZE_LANES.
#pragma once

#include <initializer_list>

#include "bc7/search.hpp"

namespace paradize::bc7::PARADIZE_WIDTH {

// The kind of a block of a row: of one colour, opaque, or with alpha.
enum class Kind { solid, opaque, alpha };

// Solid blocks are written at once.
PARADIZE_INLINE Kind kind_of(const Picture &picture, std::size_t row, std::size_t column, std::uint8_t *out) {
    std::uint32_t block[texels];
    picture.block(row, column, block);
    std::uint32_t differ = 0;
    std::uint32_t common = block[0];
    for (int t = 1; t < texels; ++t) {
        differ |= block[t] ^ block[0];
        common &= block[t];
    }
    if (differ == 0) {
        pack_solid(block[0], out + 16 * column);
        return Kind::solid;
    }
    return common >> 24 == 255 ? Kind::opaque : Kind::alpha;
}

// One row of blocks; out: 16 bytes for each.
void encode_row(const Picture &picture, std::size_t row, Quality quality, float alpha_weight,
                Scratch &scratch, std::uint8_t *out) {
    for (std::size_t first = 0; first < picture.across(); first += most_tasks) {
        const std::size_t left = picture.across() - first;
        const std::size_t blocks = left < most_tasks ? left : most_tasks;
        for (std::size_t i = 0; i < blocks; ++i) {
            scratch.kinds[i] = static_cast<std::uint8_t>(kind_of(picture, row, first + i, out));
        }
        for (const Kind kind : {Kind::opaque, Kind::alpha}) {
            std::size_t count = 0;
            for (std::size_t i = 0; i < blocks; ++i) {
                if (scratch.kinds[i] == static_cast<std::uint8_t>(kind)) {
                    scratch.tasks[count].column = static_cast<std::uint32_t>(first + i);
                    scratch.tasks[count].error = 1e29F;
                    scratch.tasks[count].left = {1e29F, 1e29F, 1e29F};
                    ++count;
                }
            }
            // Each tier begins with the result of the one below, and takes nothing that leaves more; with
            // alpha the weighted sum alone counts, or what the quickest leaves of alpha would bind colour.
            for (std::size_t tier = 0; count > 0 && tier <= static_cast<std::size_t>(quality); ++tier) {
                for (std::size_t i = 0; i < count; ++i) {
                    Task &task = scratch.tasks[i];
                    task.limit = kind == Kind::opaque ? task.left : Errors{1e29F, 1e29F, 1e29F};
                }
                const Search search{picture, row, efforts[tier], alpha_weight, scratch, count, out};
                kind == Kind::opaque ? search_opaque(search) : search_alpha(search);
            }
        }
    }
}

} // namespace paradize::bc7::PARADIZE_WIDTH
