// The slower tiers of a block's colour: which ends are tried, and how the best become bytes.
#pragma once

#include "bcn/partition.hpp"

namespace paradize::bcn::PARADIZE_WIDTH {

// Ends by least squares for `places`, then the places for those ends, `turns` times; the best are kept.
template <int Options>
PARADIZE_STEP void settle(const ColorBlocks &blocks, Places &places, int turns, const Whole &asked,
                          ColorFit &best) {
    for (int turn = 0; turn < turns; ++turn) {
        Ends codes;
        Ends ends;
        refit<Options>(blocks, places, codes);
        centred(blocks, codes, ends);
        place<true>(blocks, ends, places);
        keep(codes, places, asked, best);
    }
}

// Codes of the least and the largest of each channel; b takes the largest where the channel falls along axis.
PARADIZE_STEP void box_codes(const ColorBlocks &blocks, const Lanes (&axis)[3], Ends &codes) {
    for (int k = 0; k < 3; ++k) {
        Lanes low = blocks.v[k][0], high = blocks.v[k][0];
        for (std::size_t i = 1; i < texels; ++i) {
            low = least(low, blocks.v[k][i]);
            high = most(high, blocks.v[k][i]);
        }
        low = nearest(clamped((low + blocks.mean[k]) * (1.0F / code_unit[k]), code_top[k]));
        high = nearest(clamped((high + blocks.mean[k]) * (1.0F / code_unit[k]), code_top[k]));
        const auto falls = axis[k] < Lanes{};
        codes.a[k] = falls ? low : high;
        codes.b[k] = falls ? high : low;
    }
}

PARADIZE_STEP void try_codes(const ColorBlocks &blocks, const Ends &codes, Places &places, const Whole &asked,
                             ColorFit &best) {
    Ends ends;
    centred(blocks, codes, ends);
    place<true>(blocks, ends, places);
    keep(codes, places, asked, best);
}

// Every channel of each end one code up and down, `passes` times.
PARADIZE_STEP void descend(const ColorBlocks &blocks, int passes, ColorFit &best) {
    for (int pass = 0; pass < passes; ++pass) {
        const Lanes before = best.error;
        for (int move = 0; move < 12; ++move) {
            Ends codes = best.codes;
            const int k = move / 4;
            Lanes &code = move & 2 ? codes.b[k] : codes.a[k];
            code = clamped(code + (move & 1 ? 1.0F : -1.0F), code_top[k]);
            Places places;
            try_codes(blocks, codes, places, Whole{} == 0, best);
        }
        if (!any(best.error < before)) {
            return;
        }
    }
}

// Least squares from the outermost texels along an axis, each end drawn towards the mean by a factor.
PARADIZE_INLINE void start_from(const ColorBlocks &blocks, const Ends &outer, float draw_a, float draw_b,
                                ColorFit &best) {
    Ends ends;
    for (int k = 0; k < 3; ++k) {
        ends.a[k] = outer.a[k] * draw_a;
        ends.b[k] = outer.b[k] * draw_b;
    }
    Places places;
    place<false>(blocks, ends, places);
    settle<2>(blocks, places, 2, Whole{} == 0, best);
}

// Blocks whose colours stand nearer to each other than codes do: ends a code apart on either side serve them
// better than the nearest codes to their own.
constexpr float narrow_square = 16 * 9.0F; // three 8-bit codes from the mean

// Least squares from the nearest ends of one colour, the mean; for the lanes that are asked for.
PARADIZE_STEP void start_solid(const ColorBlocks &blocks, const Whole &asked, ColorFit &best) {
    Ends codes;
    for (int k = 0; k < 3; ++k) {
        solid_codes(blocks.mean[k], k, codes.a[k], codes.b[k]);
    }
    Places places;
    try_codes(blocks, codes, places, asked, best);
    settle<2>(blocks, places, 1, asked, best);
}

// Least squares ends where it began: what is gained comes from the number of starts. The balanced tier has
// one near the ends of the cloud, and some that leave one end's outliers to themselves; the exact tier adds
// further ones, every partition, and a search of each channel. Once the first start is made nothing is taken
// that leaves more, be it in the sum of squares or at the worst texel, and the exact tier begins with the
// balanced one's result.
PARADIZE_STEP void fit_color(const ColorBlocks &blocks, Quality quality, ColorFit &best) {
    const Whole all = Whole{} == 0;
    best.error = best.worst = best.limit = splat(1e30F);
    for (int k = 0; k < 3; ++k) {
        best.codes.a[k] = best.codes.b[k] = Lanes{};
    }
    Lanes axis[3];
    Ends outer;
    principal_axis(blocks, axis);
    axis_ends(blocks, axis, outer);
    start_from(blocks, outer, 0.875F, 0.875F, best);
    const Whole narrow = blocks.square < narrow_square;
    if (any(narrow)) {
        start_solid(blocks, narrow, best);
    }
    best.limit = best.worst;
    start_from(blocks, outer, 1.0F, 0.67F, best);
    start_from(blocks, outer, 0.67F, 1.0F, best);
    Ends codes;
    Places places;
    box_codes(blocks, axis, codes);
    try_codes(blocks, codes, places, all, best);
    for (int k = 0; k < 3; ++k) { // the box's grey diagonal, so that the simplest encoder is never better
        const auto falls = axis[k] < Lanes{};
        const Lanes a = codes.a[k];
        codes.a[k] = falls ? codes.b[k] : a;
        codes.b[k] = falls ? a : codes.b[k];
    }
    try_codes(blocks, codes, places, all, best);
    start_solid(blocks, ~narrow, best);
    if (quality == Quality::exact) {
        best.limit = best.worst;
        start_from(blocks, outer, 1.0F, 0.4F, best);
        start_from(blocks, outer, 0.4F, 1.0F, best);
        best_partition(blocks, axis, places);
        settle<4>(blocks, places, 3, all, best);
        descend(blocks, 2, best);
    }
}

// The two words of every block.
PARADIZE_STEP void pack_color(const ColorBlocks &blocks, const ColorFit &fit, Whole &first, Whole &second) {
    const Whole a = to_int(fit.codes.a[0] * 2048.0F + fit.codes.a[1] * 32.0F + fit.codes.a[2]);
    const Whole b = to_int(fit.codes.b[0] * 2048.0F + fit.codes.b[1] * 32.0F + fit.codes.b[2]);
    const auto swap = a < b; // the larger first: four colours
    Ends codes;
    for (int k = 0; k < 3; ++k) {
        codes.a[k] = swap ? fit.codes.b[k] : fit.codes.a[k];
        codes.b[k] = swap ? fit.codes.a[k] : fit.codes.b[k];
    }
    Ends ends;
    centred(blocks, codes, ends);
    Ruler ruler;
    make_ruler(ends, ruler);
    // Places counted from a: 0 at a, 3 at b.
    Whole places = {};
    for (std::size_t i = 0; i < texels; ++i) {
        places |= nearest_bits(3.0F - along(blocks, ruler, i), 2) << (2 * static_cast<int>(i));
    }
    // Stored: 0 is a, 1 is b, 2 a third from a, 3 two thirds.
    const Whole ones = Whole{} + 0x55555555;
    const Whole high = (places >> 1) & ones;
    const Whole low = places & ones;
    const Whole index = ((high ^ low) << 1) | high;
    second = a == b ? Whole{} : index;
    first = swap ? (b | a << 16) : (a | b << 16);
}

PARADIZE_STEP void encode_color(ColorBlocks &blocks, Quality quality, Whole &first, Whole &second) {
    blocks.square = Lanes{};
    for (int k = 0; k < 3; ++k) {
        Lanes sum = {};
        for (std::size_t i = 0; i < texels; ++i) {
            sum += blocks.v[k][i];
        }
        blocks.mean[k] = sum * (1.0F / 16.0F);
        for (std::size_t i = 0; i < texels; ++i) {
            blocks.v[k][i] -= blocks.mean[k];
            blocks.square += blocks.v[k][i] * blocks.v[k][i];
        }
    }
    ColorFit fit;
    fit_color(blocks, quality, fit);
    pack_color(blocks, fit, first, second);
}

} // namespace paradize::bcn::PARADIZE_WIDTH
