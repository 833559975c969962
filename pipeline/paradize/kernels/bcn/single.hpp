// One channel of a block (BC4): two 8-bit ends and a 3-bit place between them for every texel.
#pragma once

#include "bcn/encode.hpp"
#include "bcn/lanes.hpp"

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
    Lanes worst;  // the largest difference of a texel
};

// Ends in codes, low < high (or equal, where six values do), and what they leave: the squared error and the
// largest difference of a texel. limit: the worst that a fit to come may leave.
struct ValueFit {
    Lanes low;
    Lanes high;
    Lanes error;
    Lanes worst;
    Lanes limit;
    IntLanes six; // whether six values lie between the ends, or eight
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
    places.q = places.qq = places.qv = places.count = places.sum = places.square = places.worst = Lanes{};
    if constexpr (Steps == 7) {
        for (std::size_t i = 0; i < texels; ++i) {
            const Lanes q = nearest(clamped(blocks.v[i] * scale - offset, steps));
            places.q += q;
            places.qq += q * q;
            places.qv += q * blocks.v[i];
            places.worst = most(places.worst, absolute(blocks.v[i] - (low + q * step)));
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
            const Lanes left = between ? own : from_end;
            places.error += left;
            places.worst = most(places.worst, left);
            places.count += here;
            places.sum += v_here;
            places.square += v_here * v_here;
            places.q += q_here;
            places.qq += q_here * q_here;
            places.qv += q_here * v_here;
        }
        places.worst = root(places.worst);
    }
}

// Ends by least squares for the places that the texels have, rounded to codes together: for each of the codes
// about the best low end, the high end that then is best. Where the places do not tell, low and high stay.
template <int Steps, int Options>
PARADIZE_INLINE void refit(const ValueBlocks &blocks, const ValuePlaces &places, CodeRange range, Lanes &low,
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

// Takes ends that leave less, where no texel is farther off than `limit` allows.
template <int Steps>
PARADIZE_INLINE void keep(const Lanes &low, const Lanes &high, const ValuePlaces &places,
                          const IntLanes &allowed, ValueFit &best) {
    const auto better = (places.error < best.error) & (places.worst <= best.limit) & allowed;
    best.low = better ? low : best.low;
    best.high = better ? high : best.high;
    best.error = better ? places.error : best.error;
    best.worst = better ? places.worst : best.worst;
    best.six = better ? IntLanes{} - (Steps == 5) : best.six;
}

// Least squares and places in turns from the ends given; the best of the lanes that are asked for are kept.
template <int Steps>
PARADIZE_STEP void settle(const ValueBlocks &blocks, CodeRange range, int turns, Lanes low, Lanes high,
                          const IntLanes &asked, ValueFit &best) {
    ValuePlaces places;
    place<Steps>(blocks, low, high, range, places);
    keep<Steps>(low, high, places, asked, best);
    for (int turn = 0; turn < turns; ++turn) {
        refit<Steps, 2>(blocks, places, range, low, high);
        place<Steps>(blocks, low, high, range, places);
        keep<Steps>(low, high, places, asked, best);
    }
}

// All ends within `reach` codes of the best ones.
template <int Steps>
PARADIZE_STEP void search(const ValueBlocks &blocks, CodeRange range, int reach, const IntLanes &asked,
                          ValueFit &best) {
    const Lanes low = best.low, high = best.high;
    for (int down = -reach; down <= reach; ++down) {
        for (int up = -reach; up <= reach; ++up) {
            const Lanes try_low = low + static_cast<float>(down);
            const Lanes try_high = high + static_cast<float>(up);
            const auto allowed = (try_low >= range.bottom) & (try_high <= range.top) & (try_low < try_high);
            ValuePlaces places;
            place<Steps>(blocks, try_low, try_high, range, places);
            keep<Steps>(try_low, try_high, places, allowed & asked, best);
        }
    }
}

} // namespace paradize::bcn::PARADIZE_WIDTH
