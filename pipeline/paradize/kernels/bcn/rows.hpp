// Whole rows of blocks, compiled once per instruction set: include after defining PARADIZE_WIDTH and
// PARADIZE_LANES.
#pragma once

#include "bcn/fast_color.hpp"
#include "bcn/fast_single.hpp"
#include "bcn/fit.hpp"
#include "bcn/load.hpp"
#include "bcn/vectors.hpp"

namespace paradize::bcn::PARADIZE_WIDTH {

// Calls encode(column, out) for `Groups` times `lanes` blocks of one row; the last call writes beside its
// row, and what is of this row is copied.
template <std::size_t BlockBytes, std::size_t Groups = 1, typename Encode>
static inline void over_row(std::size_t columns, std::uint8_t *out, Encode &&encode) {
    constexpr std::size_t at_once = Groups * lanes;
    const std::size_t across = (columns + 3) / 4;
    for (std::size_t block = 0; block < across; block += at_once) {
        std::uint8_t *to = out + block * BlockBytes;
        if (block + at_once <= across) {
            encode(4 * block, to);
        } else {
            std::uint8_t some[at_once * BlockBytes];
            encode(4 * block, some);
            std::memcpy(to, some, (across - block) * BlockBytes);
        }
    }
}

constexpr std::size_t groups = 2; // that the fast tier takes at once, step by step

// How many groups begin within the row, from `column`.
PARADIZE_INLINE std::size_t groups_from(const Texels &from, std::size_t column, std::size_t at_most) {
    return from.columns - column > span ? at_most : 1;
}

template <bool WithAlpha>
static void fast_color_row(const Texels &from, std::size_t row, std::uint8_t *out) {
    constexpr std::size_t bytes = WithAlpha ? 16 : 8;
    over_row<bytes, groups>(from.columns, out, [&](std::size_t column, std::uint8_t *to) {
        const std::size_t count = groups_from(from, column, groups);
        FastColors colors[groups];
        ValueBlocks alpha[groups];
        IntLanes ends[groups], values[groups][2];
        for (std::size_t g = 0; g < count; ++g) {
            IntLanes words[texels];
            load_words<true>(from, 4 * row, column + g * span, words);
            find_axis(words, colors[g]);
            for (std::size_t i = 0; WithAlpha && i < texels; ++i) {
                alpha[g].v[i] = to_float(words[i] >> 24 & 255);
            }
        }
        for (std::size_t g = 0; g < count; ++g) {
            ends[g] = find_ends(colors[g]);
        }
        if constexpr (WithAlpha) {
            fast_single(alpha, count, {0.0F, 255.0F}, values);
        }
        for (std::size_t g = 0; g < count; ++g, to += lanes * bytes) {
            const IntLanes first = in_order(ends[g], Each{});
            const IntLanes second = in_order(find_places(colors[g], ends[g]), Each{});
            if constexpr (WithAlpha) {
                store_blocks({in_order(values[g][0], Each{}), in_order(values[g][1], Each{}), first, second},
                             to);
            } else {
                store_blocks(first, second, to);
            }
        }
    });
}

template <std::size_t Channels>
static void fast_value_row(const Texels &from, std::size_t row, CodeRange range, std::uint8_t *out) {
    constexpr std::size_t some = groups / Channels;
    over_row<8 * Channels, some>(from.columns, out, [&](std::size_t column, std::uint8_t *to) {
        const std::size_t count = groups_from(from, column, some);
        ValueBlocks blocks[groups];
        for (std::size_t g = 0; g < count; ++g) {
            load_values<Channels, Channels == 2>(from, 4 * row, column + g * span, range.bottom, range.top,
                                                 &blocks[g * Channels]);
        }
        IntLanes words[groups][2];
        fast_single(blocks, count * Channels, range, words);
        if constexpr (Channels == 2) {
            store_blocks({in_order(words[0][0], Each{}), in_order(words[0][1], Each{}),
                          in_order(words[1][0], Each{}), in_order(words[1][1], Each{})},
                         to);
        } else {
            for (std::size_t g = 0; g < count; ++g) {
                store_blocks(words[g][0], words[g][1], to + g * lanes * 8);
            }
        }
    });
}

template <bool WithAlpha>
static void color_row_of(const Texels &from, std::size_t row, Quality quality, std::uint8_t *out) {
    if (quality == Quality::fast) {
        return fast_color_row<WithAlpha>(from, row, out);
    }
    over_row<WithAlpha ? 16 : 8>(from.columns, out, [&](std::size_t column, std::uint8_t *to) {
        IntLanes words[texels];
        load_colors(from, 4 * row, column, words);
        ColorBlocks blocks;
        for (std::size_t i = 0; i < texels; ++i) {
            blocks.v[0][i] = to_float(words[i] & 255);
            blocks.v[1][i] = to_float(words[i] >> 8 & 255);
            blocks.v[2][i] = to_float(words[i] >> 16 & 255);
        }
        FastColors colors;
        find_axis(words, colors);
        ColorWords found;
        found.ends = find_ends(colors);
        found.indices = find_places(colors, found.ends);
        encode_color(blocks, quality, found);
        if constexpr (WithAlpha) {
            ValueBlocks alpha;
            for (std::size_t i = 0; i < texels; ++i) {
                alpha.v[i] = to_float(words[i] >> 24 & 255);
            }
            IntLanes first, second;
            encode_single(alpha, {0.0F, 255.0F}, quality, first, second);
            store_blocks({first, second, found.ends, found.indices}, to);
        } else {
            store_blocks(found.ends, found.indices, to);
        }
    });
}

template <std::size_t Channels>
static void value_row_of(const Texels &from, std::size_t row, bool is_signed, Quality quality,
                         std::uint8_t *out) {
    const CodeRange range = is_signed ? CodeRange{-127.0F, 127.0F} : CodeRange{0.0F, 255.0F};
    if (quality == Quality::fast) {
        return fast_value_row<Channels>(from, row, range, out);
    }
    over_row<8 * Channels>(from.columns, out, [&](std::size_t column, std::uint8_t *to) {
        ValueBlocks blocks[Channels];
        load_values<Channels>(from, 4 * row, column, range.bottom, range.top, blocks);
        IntLanes stored[4];
        if constexpr (Channels == 2) {
            if (is_signed) {
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
