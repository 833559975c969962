// One channel of a block (BC4): two 8-bit ends and a 3-bit place between them for every texel.
#pragma once

#include "bcn_encode.hpp"
#include "bcn_lanes.hpp"

namespace paradize::bcn::PARADIZE_WIDTH {

// The range of codes: 0..255, or -127..127.
struct CodeRange {
    float bottom;
    float top;
};

// Texels less their block's mean, in codes.
struct ValueBlocks {
    Lanes v[texels];
    Lanes mean;
    Lanes square; // sum of v^2
    Lanes low;    // codes of the least and the largest, not rounded
    Lanes high;
};

struct ValuePlaces {
    Lanes q;
    Lanes qq;
    Lanes qv;
    Lanes count;  // texels that have a place; the others take an end of the range
    Lanes sum;    // of their v
    Lanes square; // of their v
    Lanes error;  // squared, of all
};

// Ends in codes, low < high (or equal, where six values do), and the squared error that they leave.
struct ValueFit {
    Lanes low;
    Lanes high;
    Lanes error;
};

PARADIZE_INLINE Lanes within(const Lanes &v, const Lanes &bottom, const Lanes &top) {
    return least(most(v, bottom), top);
}

// Places of every texel on `Steps` + 1 even values from low to high. Five steps leave room for the range's
// own ends, which a texel takes where they are nearer.
template <int Steps>
PARADIZE_STEP void place(const ValueBlocks &blocks, const Lanes &low_code, const Lanes &high_code,
                         CodeRange range, ValuePlaces &places) {
    constexpr float steps = Steps;
    const Lanes low = low_code - blocks.mean;
    const Lanes width = high_code - low_code;
    const auto wide = width > Lanes{};
    const Lanes scale = wide ? steps / (wide ? width : splat(1.0F)) : Lanes{};
    const Lanes step = width * (1.0F / steps);
    const Lanes offset = low * scale;
    places.q = places.qq = places.qv = places.count = places.sum = places.square = Lanes{};
    if constexpr (Steps == 7) {
        for (std::size_t i = 0; i < texels; ++i) {
            const Lanes q = nearest(clamped(blocks.v[i] * scale - offset, steps));
            places.q += q;
            places.qq += q * q;
            places.qv += q * blocks.v[i];
        }
        places.count = splat(16.0F);
        places.square = blocks.square;
        places.error = blocks.square + step * (step * places.qq - 2.0F * places.qv) +
                       low * (2.0F * step * places.q + 16.0F * low);
    } else {
        const Lanes bottom = range.bottom - blocks.mean;
        const Lanes top = range.top - blocks.mean;
        places.error = Lanes{};
        for (std::size_t i = 0; i < texels; ++i) {
            const Lanes v = blocks.v[i];
            const Lanes q = nearest(clamped(v * scale - offset, steps));
            const Lanes off = v - (low + q * step);
            const Lanes own = off * off;
            const Lanes from_end = least((v - bottom) * (v - bottom), (top - v) * (top - v));
            const auto between = own <= from_end;
            const Lanes here = between ? splat(1.0F) : Lanes{};
            const Lanes q_here = q * here;
            const Lanes v_here = v * here;
            places.error += between ? own : from_end;
            places.count += here;
            places.sum += v_here;
            places.square += v_here * v_here;
            places.q += q_here;
            places.qq += q_here * q_here;
            places.qv += q_here * v_here;
        }
    }
}

// Ends by least squares for the places that the texels have, rounded to codes together: for each of the codes
// about the best low end, the high end that then is best. Where the places do not tell, low and high stay.
template <int Steps, int Options>
PARADIZE_STEP void refit(const ValueBlocks &blocks, const ValuePlaces &places, CodeRange range, Lanes &low,
                         Lanes &high) {
    constexpr float steps = Steps;
    const Lanes determinant = places.qq * places.count - places.q * places.q;
    const auto spread = determinant > 0.5F;
    const Lanes inverse = 1.0F / (spread ? determinant : splat(1.0F));
    const Lanes step = (places.qv * places.count - places.q * places.sum) * inverse;
    const Lanes start = (places.sum - step * places.q) / most(places.count, splat(1.0F));
    const Lanes best_low = blocks.mean + start;
    const Lanes best_high = best_low + step * steps;
    const Lanes hh = places.qq * (1.0F / (steps * steps));
    const Lanes lh = places.q * (1.0F / steps) - hh;
    const Lanes ll = places.count - places.q * (2.0F / steps) + hh;
    const Lanes lean = lh / (spread ? hh : splat(1.0F));
    const Lanes left = ll - lh * lean; // of the error, where high follows low
    const Lanes bottom = splat(range.bottom), top = splat(range.top);
    const Lanes first = floored(within(best_low, bottom - 4.0F, top + 4.0F));
    Lanes least_error = splat(1e30F);
    Lanes found_low = low, found_high = high;
    for (int option = 0; option < Options; ++option) {
        const Lanes try_low = within(first + static_cast<float>(option - (Options - 2) / 2), bottom, top);
        const Lanes off_low = try_low - best_low;
        const Lanes follow = best_high - lean * off_low;
        const Lanes try_high = nearest(within(follow, bottom, top));
        const Lanes off_high = try_high - follow;
        const Lanes error = left * (off_low * off_low) + hh * (off_high * off_high);
        const auto better = (error < least_error) & (try_low < try_high) & spread;
        least_error = better ? error : least_error;
        found_low = better ? try_low : found_low;
        found_high = better ? try_high : found_high;
    }
    low = found_low;
    high = found_high;
}

PARADIZE_INLINE void keep(const Lanes &low, const Lanes &high, const Lanes &error, ValueFit &best) {
    const auto better = error < best.error;
    best.low = better ? low : best.low;
    best.high = better ? high : best.high;
    best.error = better ? error : best.error;
}

// Least squares and places in turns from the ends given; the best are kept.
template <int Steps, int Options>
PARADIZE_STEP void settle(const ValueBlocks &blocks, CodeRange range, int turns, Lanes low, Lanes high,
                          ValueFit &best) {
    ValuePlaces places;
    place<Steps>(blocks, low, high, range, places);
    keep(low, high, places.error, best);
    for (int turn = 0; turn < turns; ++turn) {
        refit<Steps, Options>(blocks, places, range, low, high);
        place<Steps>(blocks, low, high, range, places);
        keep(low, high, places.error, best);
    }
}

// All ends within `reach` codes of the best ones.
template <int Steps>
PARADIZE_STEP void search(const ValueBlocks &blocks, CodeRange range, int reach, ValueFit &best) {
    const Lanes low = best.low, high = best.high;
    for (int down = -reach; down <= reach; ++down) {
        for (int up = -reach; up <= reach; ++up) {
            const Lanes try_low = low + static_cast<float>(down);
            const Lanes try_high = high + static_cast<float>(up);
            const auto allowed = (try_low >= range.bottom) & (try_high <= range.top) & (try_low < try_high);
            ValuePlaces places;
            place<Steps>(blocks, try_low, try_high, range, places);
            keep(try_low, try_high, allowed ? places.error : splat(1e30F), best);
        }
    }
}

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
