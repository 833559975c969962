// Whole rows of blocks, compiled once per instruction set: include after defining PARADIZE_WIDTH and
// PARADIZE_LANES.
#pragma once

#include "bcn_fit.hpp"
#include "bcn_load.hpp"
#include "bcn_vectors.hpp"

namespace paradize::bcn::PARADIZE_WIDTH {

// Calls encode(column, out) for groups of `lanes` blocks of one row; the last group writes beside its row,
// and what is of this row is copied.
template <std::size_t BlockBytes, typename Encode>
static inline void over_row(std::size_t columns, std::uint8_t *out, Encode &&encode) {
    const std::size_t across = (columns + 3) / 4;
    for (std::size_t block = 0; block < across; block += lanes) {
        std::uint8_t *to = out + block * BlockBytes;
        if (block + lanes <= across) {
            encode(4 * block, to);
        } else {
            std::uint8_t some[lanes * BlockBytes];
            encode(4 * block, some);
            std::memcpy(to, some, (across - block) * BlockBytes);
        }
    }
}

template <bool WithAlpha>
static void color_row_of(const Texels &from, std::size_t row, Quality quality, std::uint8_t *out) {
    over_row<WithAlpha ? 16 : 8>(from.columns, out, [&](std::size_t column, std::uint8_t *to) {
        Whole words[texels];
        load_colors(from, 4 * row, column, words);
        ColorBlocks blocks;
        for (std::size_t i = 0; i < texels; ++i) {
            blocks.v[0][i] = to_float(words[i] & 255);
            blocks.v[1][i] = to_float(words[i] >> 8 & 255);
            blocks.v[2][i] = to_float(words[i] >> 16 & 255);
        }
        Whole stored[4];
        encode_color(blocks, quality, stored[2], stored[3]);
        if constexpr (WithAlpha) {
            ValueBlocks alpha;
            for (std::size_t i = 0; i < texels; ++i) {
                alpha.v[i] = to_float(words[i] >> 24 & 255);
            }
            encode_single(alpha, {0.0F, 255.0F}, quality, stored[0], stored[1]);
            store_blocks(stored, to);
        } else {
            store_blocks(stored[2], stored[3], to);
        }
    });
}

template <std::size_t Channels>
static void value_row_of(const Texels &from, std::size_t row, bool is_signed, Quality quality,
                         std::uint8_t *out) {
    const CodeRange range = is_signed ? CodeRange{-127.0F, 127.0F} : CodeRange{0.0F, 255.0F};
    over_row<8 * Channels>(from.columns, out, [&](std::size_t column, std::uint8_t *to) {
        ValueBlocks blocks[Channels];
        load_values(from, 4 * row, column, range.bottom, range.top, blocks);
        Whole stored[4];
        if constexpr (Channels == 2) {
            if (is_signed && quality != Quality::fast) {
                encode_vectors(blocks, range, quality, stored);
                store_blocks(stored, to);
                return;
            }
        }
        for (std::size_t c = 0; c < Channels; ++c) {
            encode_single(blocks[c], range, quality, stored[2 * c], stored[2 * c + 1]);
        }
        if constexpr (Channels == 2) {
            store_blocks(stored, to);
        } else {
            store_blocks(stored[0], stored[1], to);
        }
    });
}

// One row of blocks of colours -> BC1, or BC3 with alpha.
void color_row(const Texels &from, std::size_t row, bool with_alpha, Quality quality, std::uint8_t *out) {
    (with_alpha ? color_row_of<true> : color_row_of<false>)(from, row, quality, out);
}

// One row of blocks of one or two channels -> BC4 or BC5.
void value_row(const Texels &from, std::size_t row, bool is_signed, Quality quality, std::uint8_t *out) {
    (from.channels == 2 ? value_row_of<2> : value_row_of<1>)(from, row, is_signed, quality, out);
}

} // namespace paradize::bcn::PARADIZE_WIDTH
