// The slower tiers of one channel of a block: which ends are tried, and how the best become bytes.
#pragma once

#include "bcn/single.hpp"

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

// The outermost ends of six values: of what lies between the range's own.
PARADIZE_INLINE void outer_six(const ValueBlocks &blocks, CodeRange range, Lanes &low, Lanes &high) {
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
    low = nearest(some ? low + blocks.mean : splat(range.bottom));
    high = nearest(some ? high + blocks.mean : splat(range.bottom));
}

// The first start's result, the balanced tier's, and the exact one's if that is asked for. Each begins with
// the one before and takes nothing that leaves more, be it in the sum of squares or at the worst texel. Six
// values and the range's own ends are for blocks that touch those.
PARADIZE_STEP void fit_single(const ValueBlocks &blocks, CodeRange range, Quality quality,
                              ValueFit (&fits)[3]) {
    ValueFit best;
    const Whole all = Whole{} == 0;
    Lanes low, high, low_six, high_six;
    outer_eight(blocks, range, low, high);
    best = {low, high, splat(1e30F), splat(1e30F), splat(1e30F), Whole{}};
    settle<7>(blocks, range, 1, low, high, all, best);
    const Whole touches =
        ((blocks.low < range.bottom + 0.5F) | (blocks.high > range.top - 0.5F)) & (best.error > 1e-3F);
    const bool some = any(touches);
    if (some) {
        outer_six(blocks, range, low_six, high_six);
        settle<5>(blocks, range, 1, low_six, high_six, touches, best);
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

// Place of a texel -> the index that is stored: 0 and 1 are the ends, then from the first to the second.
template <int Steps>
PARADIZE_INLINE Whole stored(const Whole &from_first) {
    const Whole next = from_first + 1;
    return from_first == 0 ? Whole{} : (from_first == Steps ? Whole{} + 1 : next);
}

struct ValueWords {
    Whole first;
    Whole second;
};

PARADIZE_INLINE void add_index(const Whole &index, int i, ValueWords &words) {
    if (i < 5) {
        words.first |= index << (16 + 3 * i);
    } else if (i == 5) {
        words.first |= index << 31;
        words.second |= index >> 1;
    } else {
        words.second |= index << (3 * i - 16);
    }
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

// The two words of every block.
PARADIZE_STEP void pack_single(const ValueBlocks &blocks, CodeRange range, const ValueFit &fit, Whole &first,
                               Whole &second) {
    ValueWords words = {};
    {
        const Lanes width = fit.high - fit.low;
        const Lanes scale = 7.0F / (fit.six ? splat(1.0F) : width);
        const Lanes offset = (fit.high - blocks.mean) * scale;
        for (std::size_t i = 0; i < texels; ++i) { // places from the high end, which is stored first
            const Lanes q = clamped(offset - blocks.v[i] * scale, 7.0F);
            add_index(stored<7>(nearest_bits(q, 3)), static_cast<int>(i), words);
        }
        words.first |= (to_int(fit.high) & 255) | (to_int(fit.low) & 255) << 8;
    }
    if (any(fit.six)) {
        ValueWords other = {};
        const Lanes width = fit.high - fit.low;
        const auto wide = width > Lanes{};
        const Lanes scale = wide ? 5.0F / (wide ? width : splat(1.0F)) : Lanes{};
        const Lanes start = fit.low - blocks.mean;
        const Lanes bottom = range.bottom - blocks.mean;
        const Lanes top = range.top - blocks.mean;
        for (std::size_t i = 0; i < texels; ++i) { // places from the low end, which is stored first
            const Lanes v = blocks.v[i];
            const Lanes q = clamped((v - start) * scale, 5.0F);
            const Lanes off = v - (start + nearest(q) * (width * (1.0F / 5.0F)));
            const Lanes to_bottom = (v - bottom) * (v - bottom);
            const Lanes to_top = (top - v) * (top - v);
            const auto end = off * off > least(to_bottom, to_top);
            const Whole index =
                end ? (to_bottom <= to_top ? Whole{} + 6 : Whole{} + 7) : stored<5>(nearest_bits(q, 3));
            add_index(index, static_cast<int>(i), other);
        }
        other.first |= (to_int(fit.low) & 255) | (to_int(fit.high) & 255) << 8;
        words.first = fit.six ? other.first : words.first;
        words.second = fit.six ? other.second : words.second;
    }
    first = words.first;
    second = words.second;
}

// blocks.v: codes within the range.
PARADIZE_STEP void encode_single(ValueBlocks &blocks, CodeRange range, Quality quality, Whole &first,
                                 Whole &second) {
    ValueFit fits[3];
    centre(blocks);
    fit_single(blocks, range, quality, fits);
    pack_single(blocks, range, fits[static_cast<int>(quality)], first, second);
}

} // namespace paradize::bcn::PARADIZE_WIDTH
