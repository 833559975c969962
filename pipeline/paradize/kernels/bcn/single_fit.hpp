// The slower tiers of one channel of a block: which ends are tried.
#pragma once

#include "bcn/single_pack.hpp"

namespace paradize::bcn::PARADIZE_WIDTH {

// Where else the ends may start: how many steps inside the outermost texels, the low end and the high one.
struct Inset {
    float low;
    float high;
};

constexpr Inset some_insets[] = {{0.5F, 0.5F}, {1.0F, 0.0F}, {0.0F, 1.0F}, {-0.5F, -0.5F}};
constexpr Inset all_insets[] = {{0.5F, 0.0F}, {0.0F, 0.5F},  {1.0F, 1.0F},  {2.0F, 0.0F},
                                {0.0F, 2.0F}, {-0.5F, 0.0F}, {0.0F, -0.5F}, {-1.0F, -1.0F},
                                {1.0F, 2.0F}, {2.0F, 1.0F},  {-0.5F, 1.0F}, {1.0F, -0.5F}};

// Least squares from ends moved inwards, `turns` times from each.
template <int Steps, std::size_t N>
PARADIZE_INLINE void start_elsewhere(const ValueBlocks &blocks, CodeRange range, const Inset (&insets)[N],
                                     int turns, ValueFit &best) {
    const Lanes step = (blocks.high - blocks.low) * (1.0F / Steps);
    const Lanes bottom = splat(range.bottom), top = splat(range.top);
    for (const Inset &inset : insets) {
        const Lanes low = nearest(within(blocks.low + inset.low * step, bottom, top));
        const Lanes high = nearest(within(blocks.high - inset.high * step, bottom, top));
        const auto wide = low < high;
        settle<Steps>(blocks, range, turns, low, high, wide, best);
    }
}

// The outermost ends of eight values.
PARADIZE_INLINE void outer_eight(const ValueBlocks &blocks, CodeRange range, Lanes &low, Lanes &high) {
    low = nearest(blocks.low);
    high = nearest(blocks.high);
    // A block within one code still has room on that side of it where its mean lies.
    const auto flat = low == high;
    const auto below = ((blocks.mean < low) & (low > range.bottom)) | (high >= range.top);
    low = flat & below ? low - 1.0F : low;
    high = flat & ~below ? high + 1.0F : high;
}

// Blocks that touch the ends of the range.
PARADIZE_INLINE IntLanes touching(const ValueBlocks &blocks, CodeRange range) {
    return (blocks.low < range.bottom + 0.5F) | (blocks.high > range.top - 0.5F);
}

// The outermost ends of six values: of what lies between the range's own. Returns which blocks have something
// there, at most a third as wide as the block.
PARADIZE_STEP IntLanes outer_six(const ValueBlocks &blocks, CodeRange range, Lanes &low, Lanes &high) {
    const Lanes bottom = range.bottom + 0.5F - blocks.mean;
    const Lanes top = range.top - 0.5F - blocks.mean;
    low = splat(1e30F);
    high = splat(-1e30F);
    for (std::size_t i = 0; i < texels; ++i) {
        const auto inside = (blocks.v[i] >= bottom) & (blocks.v[i] <= top);
        low = least(low, inside ? blocks.v[i] : splat(1e30F));
        high = most(high, inside ? blocks.v[i] : splat(-1e30F));
    }
    const auto some = low <= high;
    const IntLanes narrow = some & ((high - low) * 3.0F <= blocks.high - blocks.low);
    low = nearest(some ? low + blocks.mean : splat(range.bottom));
    high = nearest(some ? high + blocks.mean : splat(range.bottom));
    return narrow;
}

// blocks.v: codes within the range. Makes them relative to their mean.
PARADIZE_INLINE void centre(ValueBlocks &blocks) {
    Lanes sum = blocks.v[0], low = blocks.v[0], high = blocks.v[0];
    for (std::size_t i = 1; i < texels; ++i) {
        sum += blocks.v[i];
        low = least(low, blocks.v[i]);
        high = most(high, blocks.v[i]);
    }
    blocks.mean = sum * (1.0F / 16.0F);
    blocks.low = low;
    blocks.high = high;
    blocks.square = Lanes{};
    for (std::size_t i = 0; i < texels; ++i) {
        blocks.v[i] -= blocks.mean;
        blocks.square += blocks.v[i] * blocks.v[i];
    }
}

// The result of the fast tier, that of the balanced one, and that of the exact one if it is asked for. Each
// begins with the one before and takes nothing that leaves more, be it in the sum of squares or at the worst
// texel. Six values and the range's own ends are for blocks that touch those.
PARADIZE_STEP void fit_single(const ValueBlocks &blocks, CodeRange range, Quality quality,
                              ValueFit (&fits)[3]) {
    const IntLanes all = IntLanes{} == 0;
    Lanes low, high, low_six, high_six;
    outer_eight(blocks, range, low, high);
    ValueFit best = {low, high, {}, {}, {}, {}};
    ValuePlaces places;
    place<7>(blocks, low, high, range, places);
    refit<7, 2>(blocks, places, range, best.low, best.high);
    place<7>(blocks, best.low, best.high, range, places);
    best.error = places.error;
    best.worst = places.worst;
    best.limit = splat(1e30F);
    const IntLanes touches = touching(blocks, range) & (best.error > 1e-3F);
    const bool some = any(touches);
    if (some) {
        const IntLanes narrow = outer_six(blocks, range, low_six, high_six);
        settle<5>(blocks, range, 0, low_six, high_six, touches & narrow, best);
    }
    fits[0] = best;
    best.limit = best.worst;
    settle<7>(blocks, range, 2, low, high, all, best);
    start_elsewhere<7>(blocks, range, some_insets, 1, best);
    if (some) {
        settle<5>(blocks, range, 2, low_six, high_six, touches, best);
    }
    fits[1] = best;
    if (quality == Quality::balanced) {
        return;
    }
    best.limit = best.worst;
    start_elsewhere<7>(blocks, range, all_insets, 2, best);
    search<7>(blocks, range, 2, ~best.six, best);
    if (some) {
        search<5>(blocks, range, 2, best.six, best);
    }
    fits[2] = best;
}

// blocks.v: codes within the range.
PARADIZE_STEP void encode_single(ValueBlocks &blocks, CodeRange range, Quality quality, IntLanes &first,
                                 IntLanes &second) {
    ValueFit fits[3];
    centre(blocks);
    fit_single(blocks, range, quality, fits);
    pack_single(blocks, range, fits[static_cast<int>(quality)], first, second);
}

} // namespace paradize::bcn::PARADIZE_WIDTH
