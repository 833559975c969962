// A row of blocks, compiled once per instruction set: include after defining PARADIZE_WIDTH and
// PARADIZE_LANES.
#pragma once

#include "bc7_modes.hpp"
#include "bc7_pack.hpp"
#include "bc7_picture.hpp"

namespace paradize::bc7::PARADIZE_WIDTH {

// The texels of up to `lanes` blocks of a row; the last block stands in for those that are missing.
PARADIZE_INLINE void load(const Picture &picture, std::size_t row, const std::uint32_t *columns,
                          std::size_t count, Block &block) {
    alignas(64) std::uint32_t packed[texels][lanes];
    for (int lane = 0; lane < lanes; ++lane) {
        const auto at = static_cast<std::size_t>(lane);
        const std::size_t column = columns[at < count ? at : count - 1];
        for (int t = 0; t < texels; ++t) {
            packed[t][lane] = picture.texel(row, column, t);
        }
    }
    for (int t = 0; t < texels; ++t) {
        Whole bits;
        __builtin_memcpy(&bits, packed[t], sizeof bits);
        for (int c = 0; c < 4; ++c) {
            block.v[c][t] = __builtin_convertvector((bits >> (8 * c)) & 255, Lanes);
        }
    }
}

PARADIZE_INLINE Choice choice_of(const Best &best, int lane) {
    Choice choice;
    choice.mode = best.mode[lane];
    choice.partition = best.partition[lane];
    choice.rotation = best.rotation[lane];
    choice.selector = best.selector[lane];
    for (int s = 0; s < 3; ++s) {
        for (int end = 0; end < 2; ++end) {
            for (int c = 0; c < 4; ++c) {
                choice.code[s][end][c] = static_cast<int>(best.code[s][end][c][lane]);
            }
        }
    }
    for (int t = 0; t < texels; ++t) {
        choice.index[t] = static_cast<int>(best.index[t][lane]);
        choice.second[t] = static_cast<int>(best.second[t][lane]);
    }
    return choice;
}

// The blocks of one kind in a row. columns: which they are; afterwards, those whose error is above `enough`
// stand at its front. Returns their number.
static std::size_t encode_some(const Picture &picture, std::size_t row, bool opaque, const Effort &effort,
                               std::uint32_t *columns, std::size_t count, std::uint8_t *out) {
    std::size_t left = 0;
    for (std::size_t first = 0; first < count; first += lanes) {
        const std::size_t some = count - first < lanes ? count - first : lanes;
        Block block;
        load(picture, row, columns + first, some, block);
        Best best;
        clear(best);
        (opaque ? try_opaque : try_alpha)(block, effort, best);
        for (std::size_t lane = 0; lane < some; ++lane) {
            const std::uint32_t column = columns[first + lane];
            Choice choice = choice_of(best, static_cast<int>(lane));
            pack(choice, out + 16 * column);
            if (best.error[lane] > effort.enough) {
                columns[left++] = column;
            }
        }
    }
    return left;
}

// One row of blocks. scratch: room for two numbers per block of the row.
void encode_row(const Picture &picture, std::size_t row, const Effort &effort, std::uint32_t *scratch,
                std::uint8_t *out) {
    const std::size_t across = picture.across();
    std::uint32_t *kinds[2] = {scratch, scratch + across};
    std::size_t counts[2] = {0, 0};
    for (std::size_t column = 0; column < across; ++column) {
        const std::uint32_t first = picture.texel(row, column, 0);
        std::uint32_t differ = 0;
        std::uint32_t common = first;
        for (int t = 1; t < texels; ++t) {
            const std::uint32_t texel = picture.texel(row, column, t);
            differ |= texel ^ first;
            common &= texel;
        }
        if (differ == 0) {
            pack_solid(first, out + 16 * column);
            continue;
        }
        const std::size_t kind = common >> 24 == 255 ? 1 : 0;
        kinds[kind][counts[kind]++] = static_cast<std::uint32_t>(column);
    }
    Effort quick{};
    quick.passes6 = effort.passes6;
    quick.enough = effort.enough;
    for (std::size_t kind = 0; kind < 2; ++kind) {
        const bool opaque = kind == 1;
        const std::size_t left = encode_some(picture, row, opaque, quick, kinds[kind], counts[kind], out);
        if (left > 0 && effort.more(opaque)) {
            encode_some(picture, row, opaque, effort, kinds[kind], left, out);
        }
    }
}

} // namespace paradize::bc7::PARADIZE_WIDTH
