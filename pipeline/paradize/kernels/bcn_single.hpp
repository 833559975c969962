// One channel of a block (BC4): two 8-bit endpoints and a 3-bit place between them for every texel.
#pragma once

#include "bcn_lanes.hpp"

namespace paradize::bcn::PARADIZE_WIDTH {

// The endpoints of a block in code units and the squared error that they leave.
struct Endpoints {
    float low;
    float high;
    float error;
};

// The range of codes: 0..255, or -127..127.
struct CodeRange {
    float bottom;
    float top;
};

PARADIZE_INLINE float rounded_code(float v, CodeRange range) {
    return rounded(v - range.bottom, range.top - range.bottom) + range.bottom;
}

// Squared error of `steps` + 1 evenly spaced values from low to high; with Extremes the range's ends count
// too.
template <bool Extremes>
PARADIZE_INLINE float single_error(const Lanes &v, float low, float high, CodeRange range) {
    constexpr float steps = Extremes ? 5.0F : 7.0F;
    const float width = high - low;
    const float to_step = width > 0.0F ? steps / width : 0.0F;
    const float from_step = width * (1.0F / steps);
    Lanes q;
    rounded((v - low) * to_step, steps, q);
    const Lanes d = v - (low + q * from_step);
    Lanes square = d * d;
    if constexpr (Extremes) {
        const Lanes bottom = (v - range.bottom) * (v - range.bottom);
        const Lanes top = (v - range.top) * (v - range.top);
        square = bottom < square ? bottom : square;
        square = top < square ? top : square;
    }
    return sum(square);
}

// The least-squares line through the texels, given the step that each takes between low and high; rounded to
// codes.
PARADIZE_INLINE Endpoints refit(const Lanes &v, float low, float high, CodeRange range) {
    constexpr float steps = 7.0F;
    const float to_step = high > low ? steps / (high - low) : 0.0F;
    Lanes q;
    rounded((v - low) * to_step, steps, q);
    q = q * (1.0F / steps);
    const float n = static_cast<float>(texels);
    const float sq = sum(q);
    const float determinant = n * sum(q * q) - sq * sq;
    if (!(determinant > 1e-3F)) {
        return {low, high, 0.0F};
    }
    const float sv = sum(v);
    const float slope = (n * sum(q * v) - sq * sv) / determinant;
    const float start = (sv - slope * sq) / n;
    return {rounded_code(start, range), rounded_code(start + slope, range), 0.0F};
}

// Walks to better endpoints, a code at a time, until no neighbour is better (at most `passes` passes).
template <bool Extremes>
PARADIZE_INLINE void descend(const Lanes &v, CodeRange range, int passes, Endpoints &best) {
    for (int pass = 0; pass < passes && best.error > 0.0F; ++pass) {
        const Endpoints start = best;
        for (int k = 0; k < 9; ++k) {
            const float low = start.low + static_cast<float>(k % 3 - 1);
            const float high = start.high + static_cast<float>(k / 3 - 1);
            if (k == 4 || low < range.bottom || high > range.top || low >= high) {
                continue;
            }
            const float error = single_error<Extremes>(v, low, high, range);
            if (error < best.error) {
                best = {low, high, error};
            }
        }
        if (best.low == start.low && best.high == start.high) {
            return;
        }
    }
}

// The ends of what lies between the range's own ends; false where nothing does.
PARADIZE_INLINE bool inner_ends(const Lanes &v, CodeRange range, Endpoints &ends) {
    const Lanes zero = {};
    const Lanes bottom = zero + (range.bottom + 0.5F);
    const Lanes top = zero + (range.top - 0.5F);
    const Lanes highest = zero + range.top;
    const Lanes lowest = zero + range.bottom;
    const Lanes for_low = v < bottom ? highest : (v > top ? highest : v);
    const Lanes for_high = v < bottom ? lowest : (v > top ? lowest : v);
    ends.low = smallest(for_low);
    ends.high = largest(for_high);
    return ends.low <= ends.high;
}

// v: sixteen values in code units within the range. passes: of the search around the endpoints. out: 8 bytes.
PARADIZE_INLINE void encode_single(const Lanes &v, CodeRange range, int passes, std::uint8_t *out) {
    const float low = smallest(v);
    const float high = largest(v);
    Endpoints plain{rounded_code(low, range), rounded_code(high, range), 0.0F};
    if (plain.low ==
        plain.high) { // a flat block still has room on either side for what lies between two codes
        if (plain.high < range.top) {
            plain.high += 1.0F;
        } else {
            plain.low -= 1.0F;
        }
    }
    plain.error = single_error<false>(v, plain.low, plain.high, range);
    if (plain.error > 0.0F) {
        Endpoints fit = refit(v, plain.low, plain.high, range);
        if (fit.low < fit.high) {
            fit.error = single_error<false>(v, fit.low, fit.high, range);
            plain = fit.error < plain.error ? fit : plain;
        }
        descend<false>(v, range, passes, plain);
    }
    // The other mode: six values and the ends of the range, for blocks that touch the ends.
    bool extremes = false;
    Endpoints spread{range.bottom, range.bottom, 0.0F};
    if (plain.error > 0.0F && (low < range.bottom + 0.5F || high > range.top - 0.5F)) {
        if (inner_ends(v, range, spread)) {
            spread.low = rounded_code(spread.low, range);
            spread.high = rounded_code(spread.high, range);
        } else { // nothing but ends
            spread.low = spread.high = range.bottom;
        }
        spread.error = single_error<true>(v, spread.low, spread.high, range);
        if (spread.error < 4.0F * plain.error) {
            descend<true>(v, range, passes, spread);
        }
        extremes = spread.error < plain.error;
    }

    const Endpoints best = extremes ? spread : plain;
    const float steps = extremes ? 5.0F : 7.0F;
    const float to_step = best.high > best.low ? steps / (best.high - best.low) : 0.0F;
    Lanes q;
    rounded((v - best.low) * to_step, steps, q);
    const Whole step = __builtin_convertvector(q, Whole);
    const Whole zero = {};
    Whole index;
    if (!extremes) { // stored high first: 0 is high, 1 is low, 2..7 go from high to low
        index = step == 7 ? zero : (step == 0 ? zero + 1 : 8 - step);
    } else { // stored low first: 0 is low, 1 is high, 2..5 go from low to high, 6 and 7 are the ends
        const Lanes d = v - (best.low + q * ((best.high - best.low) * (1.0F / steps)));
        const Lanes own = d * d;
        const Lanes bottom = (v - range.bottom) * (v - range.bottom);
        const Lanes top = (v - range.top) * (v - range.top);
        index = step == 0 ? zero : (step == 5 ? zero + 1 : step + 1);
        index = bottom < own ? zero + 6 : index;
        index = top < (bottom < own ? bottom : own) ? zero + 7 : index;
    }
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < texels; ++i) {
        bits |= static_cast<std::uint64_t>(index[i]) << (3 * i);
    }
    out[0] = static_cast<std::uint8_t>(static_cast<int>(extremes ? best.low : best.high));
    out[1] = static_cast<std::uint8_t>(static_cast<int>(extremes ? best.high : best.low));
    for (std::size_t i = 0; i < 6; ++i) {
        out[2 + i] = static_cast<std::uint8_t>(bits >> (8 * i));
    }
}

} // namespace paradize::bcn::PARADIZE_WIDTH
