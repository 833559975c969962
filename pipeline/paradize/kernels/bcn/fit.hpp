// The slower tiers of a block's colour: which ends are tried, and how the best become bytes.
#pragma once

#include "bcn/partition.hpp"

namespace paradize::bcn::PARADIZE_WIDTH {

// Ends by least squares for `places`, then the places for those ends, `turns` times; the best are kept.
template <int Options>
PARADIZE_STEP void settle(const ColorBlocks &blocks, Places &places, int turns, ColorFit &best) {
    for (int turn = 0; turn < turns; ++turn) {
        Endpoints codes;
        Endpoints ends;
        refit<Options>(blocks, places, codes);
        centred(blocks, codes, ends);
        place<true>(blocks, ends, places);
        keep(codes, places, best);
    }
}

// Codes of the least and the largest of each channel; b takes the largest where the channel falls along axis.
PARADIZE_STEP void box_codes(const ColorBlocks &blocks, const Lanes (&axis)[3], Endpoints &codes) {
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

PARADIZE_STEP void try_codes(const ColorBlocks &blocks, const Endpoints &codes, Places &places,
                             ColorFit &best) {
    Endpoints ends;
    centred(blocks, codes, ends);
    place<true>(blocks, ends, places);
    keep(codes, places, best);
}

// Every channel of each end one code up and down, `passes` times.
PARADIZE_STEP void descend(const ColorBlocks &blocks, int passes, ColorFit &best) {
    for (int pass = 0; pass < passes; ++pass) {
        const Lanes before = best.error;
        for (int move = 0; move < 12; ++move) {
            Endpoints codes = best.codes;
            const int k = move / 4;
            Lanes &code = move & 2 ? codes.b[k] : codes.a[k];
            code = clamped(code + (move & 1 ? 1.0F : -1.0F), code_top[k]);
            Places places;
            try_codes(blocks, codes, places, best);
        }
        if (!any(best.error < before)) {
            return;
        }
    }
}

// Least squares from the outermost texels along an axis, each end drawn towards the mean by a factor.
PARADIZE_INLINE void start_from(const ColorBlocks &blocks, const Endpoints &outer, float draw_a, float draw_b,
                                ColorFit &best) {
    Endpoints ends;
    for (int k = 0; k < 3; ++k) {
        ends.a[k] = outer.a[k] * draw_a;
        ends.b[k] = outer.b[k] * draw_b;
    }
    Places places;
    place<false>(blocks, ends, places);
    settle<2>(blocks, places, 2, best);
}

// Least squares from the nearest ends of one colour, the mean.
PARADIZE_STEP void start_solid(const ColorBlocks &blocks, ColorFit &best) {
    Endpoints codes;
    for (int k = 0; k < 3; ++k) {
        solid_codes(blocks.mean[k], k, codes.a[k], codes.b[k]);
    }
    Places places;
    try_codes(blocks, codes, places, best);
    settle<2>(blocks, places, 1, best);
}

// The two words of a block: its ends, the larger first, and the indices of its texels.
struct ColorWords {
    IntLanes ends;
    IntLanes indices;
};

// The ends that are stored, and what they and the indices leave.
PARADIZE_STEP void measure(const ColorBlocks &blocks, const ColorWords &words, ColorFit &fit) {
    constexpr int at[3] = {11, 5, 0};
    for (int k = 0; k < 3; ++k) {
        const int mask = k == 1 ? 63 : 31;
        fit.codes.a[k] = to_float(words.ends >> at[k] & mask);
        fit.codes.b[k] = to_float(words.ends >> (at[k] + 16) & mask);
    }
    Endpoints ends;
    centred(blocks, fit.codes, ends);
    fit.error = fit.worst = Lanes{};
    for (std::size_t i = 0; i < texels; ++i) {
        const IntLanes index = words.indices >> (2 * static_cast<int>(i)) & 3;
        const Lanes share = to_float(index < 2 ? 3 - 3 * index : 4 - index) * (1.0F / 3.0F); // of a
        for (int k = 0; k < 3; ++k) {
            const Lanes off = blocks.v[k][i] - (ends.b[k] + share * (ends.a[k] - ends.b[k]));
            fit.error += off * off;
            fit.worst = most(fit.worst, absolute(off));
        }
    }
}

// Least squares ends where it began: what is gained comes from the number of starts. The balanced tier has
// one near the ends of the cloud, and some that leave one end's outliers to themselves; the exact tier adds
// further ones, every partition, and a search of each channel. `best` is the fast tier's result; nothing is
// taken that leaves more, be it in the sum of squares or at the worst texel, and the exact tier goes on so
// from the balanced one's result.
PARADIZE_STEP void fit_color(const ColorBlocks &blocks, Quality quality, ColorFit &best) {
    best.limit = best.worst;
    Lanes axis[3];
    Endpoints outer;
    principal_axis(blocks, axis);
    axis_ends(blocks, axis, outer);
    start_from(blocks, outer, 0.875F, 0.875F, best);
    start_from(blocks, outer, 1.0F, 0.67F, best);
    start_from(blocks, outer, 0.67F, 1.0F, best);
    Endpoints codes;
    Places places;
    box_codes(blocks, axis, codes);
    try_codes(blocks, codes, places, best);
    for (int k = 0; k < 3; ++k) { // the box's grey diagonal, so that the simplest encoder is never better
        const auto falls = axis[k] < Lanes{};
        const Lanes a = codes.a[k];
        codes.a[k] = falls ? codes.b[k] : a;
        codes.b[k] = falls ? a : codes.b[k];
    }
    try_codes(blocks, codes, places, best);
    start_solid(blocks, best);
    if (quality == Quality::exact) {
        best.limit = best.worst;
        start_from(blocks, outer, 1.0F, 0.4F, best);
        start_from(blocks, outer, 0.4F, 1.0F, best);
        best_partition(blocks, axis, places);
        settle<4>(blocks, places, 3, best);
        descend(blocks, 2, best);
    }
}

PARADIZE_STEP ColorWords pack_color(const ColorBlocks &blocks, const ColorFit &fit) {
    const IntLanes a = to_int(fit.codes.a[0] * 2048.0F + fit.codes.a[1] * 32.0F + fit.codes.a[2]);
    const IntLanes b = to_int(fit.codes.b[0] * 2048.0F + fit.codes.b[1] * 32.0F + fit.codes.b[2]);
    Endpoints ends;
    centred(blocks, fit.codes, ends);
    ProjectionAxis ruler;
    make_ruler(ends, ruler);
    IntLanes from_b = {};
    for (std::size_t i = 0; i < texels; ++i) {
        from_b |= nearest_bits(along(blocks, ruler, i), 2) << (2 * static_cast<int>(i));
    }
    const auto swap = a < b; // the larger first: four colours
    const IntLanes places = swap ? from_b : ~from_b;
    // Stored: 0 is the first, 1 the second, 2 a third from the first, 3 two thirds.
    const IntLanes ones = IntLanes{} + 0x55555555;
    const IntLanes high = (places >> 1) & ones;
    const IntLanes low = places & ones;
    const IntLanes index = ((high ^ low) << 1) | high;
    return {swap ? (b | a << 16) : (a | b << 16), a == b ? IntLanes{} : index};
}

// blocks.v: codes. words: those of the fast tier, which become the better ones of `quality`.
PARADIZE_STEP void encode_color(ColorBlocks &blocks, Quality quality, ColorWords &words) {
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
    measure(blocks, words, fit);
    const Lanes before = fit.error;
    fit_color(blocks, quality, fit);
    const ColorWords found = pack_color(blocks, fit);
    const auto better = fit.error < before;
    words.ends = better ? found.ends : words.ends;
    words.indices = better ? found.indices : words.indices;
}

} // namespace paradize::bcn::PARADIZE_WIDTH
