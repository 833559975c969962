// The tiers of one channel of a block: which ends are tried, and how the best become bytes.
#pragma once

#include "bcn_single.hpp"

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
        settle<Steps, 2>(blocks, range, turns, wide ? low : best.low, wide ? high : best.high, best);
    }
}

constexpr int turns_of(Quality quality) {
    return quality == Quality::fast ? 1 : 2;
}

// Eight values from low to high.
PARADIZE_STEP void fit_eight(const ValueBlocks &blocks, CodeRange range, Quality quality, ValueFit &best) {
    Lanes low = nearest(blocks.low);
    Lanes high = nearest(blocks.high);
    // A block within one code still has room on that side of it where its mean lies.
    const auto flat = low == high;
    const auto below = ((blocks.mean < low) & (low > range.bottom)) | (high >= range.top);
    low = flat & below ? low - 1.0F : low;
    high = flat & ~below ? high + 1.0F : high;
    best = {low, high, splat(1e30F)};
    settle<7, 2>(blocks, range, turns_of(quality), low, high, best);
    if (quality != Quality::fast) {
        start_elsewhere<7>(blocks, range, some_insets, 1, best);
    }
    if (quality == Quality::exact) {
        start_elsewhere<7>(blocks, range, all_insets, 2, best);
        search<7>(blocks, range, 2, best);
    }
}

// Six values and the range's own ends, for blocks that touch those; the error of other lanes is never less.
PARADIZE_STEP void fit_six(const ValueBlocks &blocks, CodeRange range, Quality quality, const Whole &touches,
                           ValueFit &best) {
    const Lanes bottom = range.bottom + 0.5F - blocks.mean;
    const Lanes top = range.top - 0.5F - blocks.mean;
    Lanes low = splat(1e30F), high = splat(-1e30F);
    for (std::size_t i = 0; i < texels; ++i) { // the ends of what lies between the range's own
        const auto inside = (blocks.v[i] >= bottom) & (blocks.v[i] <= top);
        low = least(low, inside ? blocks.v[i] : splat(1e30F));
        high = most(high, inside ? blocks.v[i] : splat(-1e30F));
    }
    const auto some = low <= high;
    low = nearest(some ? low + blocks.mean : splat(range.bottom));
    high = nearest(some ? high + blocks.mean : splat(range.bottom));
    best = {low, high, splat(1e30F)};
    settle<5, 2>(blocks, range, turns_of(quality), low, high, best);
    if (quality == Quality::exact) {
        search<5>(blocks, range, 2, best);
    }
    best.error = touches ? best.error : splat(1e30F);
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
PARADIZE_STEP void encode_single(ValueBlocks &blocks, CodeRange range, Quality quality, Whole &first,
                                 Whole &second) {
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
    ValueFit eight;
    fit_eight(blocks, range, quality, eight);

    ValueWords words = {};
    {
        const Lanes scale = 7.0F / (eight.high - eight.low);
        const Lanes offset = (eight.high - blocks.mean) * scale;
        for (std::size_t i = 0; i < texels; ++i) { // places from the high end, which is stored first
            const Lanes q = clamped(offset - blocks.v[i] * scale, 7.0F);
            add_index(stored<7>(nearest_bits(q, 3)), static_cast<int>(i), words);
        }
        words.first |= (to_int(eight.high) & 255) | (to_int(eight.low) & 255) << 8;
    }
    const Whole touches = ((low < range.bottom + 0.5F) | (high > range.top - 0.5F)) & (eight.error > 1e-3F);
    if (any(touches)) {
        ValueFit six;
        fit_six(blocks, range, quality, touches, six);
        ValueWords other = {};
        const Lanes width = six.high - six.low;
        const auto wide = width > Lanes{};
        const Lanes scale = wide ? 5.0F / (wide ? width : splat(1.0F)) : Lanes{};
        const Lanes start = six.low - blocks.mean;
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
        other.first |= (to_int(six.low) & 255) | (to_int(six.high) & 255) << 8;
        const auto better = six.error < eight.error;
        words.first = better ? other.first : words.first;
        words.second = better ? other.second : words.second;
    }
    first = words.first;
    second = words.second;
}

} // namespace paradize::bcn::PARADIZE_WIDTH
