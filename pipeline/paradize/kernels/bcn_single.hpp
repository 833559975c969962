// One channel of a block (BC4): two 8-bit endpoints and a 3-bit place between them for every texel.
#pragma once

#include "bcn_lanes.hpp"

#include <cstdint>

namespace paradize::bcn {

// The endpoints of a block in code units and the squared error that they leave.
struct Endpoints {
    float low = 0.0F;
    float high = 0.0F;
    float error = 0.0F;
};

// The range of codes: 0..255, or -127..127.
struct CodeRange {
    float bottom;
    float top;
};

// Squared error of `steps` + 1 evenly spaced values from low to high; with `extremes` the range's ends count
// too.
template <bool Extremes>
PARADIZE_INLINE float single_error(const Lanes &v, float low, float high, CodeRange range) {
    constexpr float steps = Extremes ? 5.0F : 7.0F;
    const float width = high - low;
    const float to_step = width > 0.0F ? steps / width : 0.0F;
    const float from_step = width / steps;
    Lanes error;
    for (std::size_t i = 0; i < texels; ++i) {
        const float q = rounded((v[i] - low) * to_step, steps);
        const float d = v[i] - (low + q * from_step);
        float square = d * d;
        if constexpr (Extremes) {
            const float bottom = v[i] - range.bottom;
            const float top = v[i] - range.top;
            square = bottom * bottom < square ? bottom * bottom : square;
            square = top * top < square ? top * top : square;
        }
        error[i] = square;
    }
    return sum(error);
}

// The least-squares line through the texels, given the step that each takes between low and high; rounded to
// codes.
PARADIZE_INLINE Endpoints refit(const Lanes &v, float low, float high, CodeRange range) {
    constexpr float steps = 7.0F;
    const float to_step = high > low ? steps / (high - low) : 0.0F;
    Lanes q;
    Lanes qq;
    Lanes qv;
    for (std::size_t i = 0; i < texels; ++i) {
        q[i] = rounded((v[i] - low) * to_step, steps) * (1.0F / steps);
        qq[i] = q[i] * q[i];
        qv[i] = q[i] * v[i];
    }
    const float n = static_cast<float>(texels);
    const float sq = sum(q);
    const float determinant = n * sum(qq) - sq * sq;
    if (!(determinant > 1e-3F)) {
        return {low, high, 0.0F};
    }
    const float sv = sum(v);
    const float slope = (n * sum(qv) - sq * sv) / determinant;
    const float start = (sv - slope * sq) / n;
    const float width = range.top - range.bottom;
    return {rounded(start - range.bottom, width) + range.bottom,
            rounded(start + slope - range.bottom, width) + range.bottom, 0.0F};
}

// Walks to better endpoints, a code at a time, until no neighbour is better (at most `passes` passes).
template <bool Extremes>
PARADIZE_INLINE void descend(const Lanes &v, CodeRange range, int passes, Endpoints &best) {
    for (int pass = 0; pass < passes; ++pass) {
        const Endpoints start = best;
        for (const float dl : {-1.0F, 0.0F, 1.0F}) {
            for (const float dh : {-1.0F, 0.0F, 1.0F}) {
                const float low = start.low + dl;
                const float high = start.high + dh;
                if ((dl == 0.0F && dh == 0.0F) || low < range.bottom || high > range.top || low >= high) {
                    continue;
                }
                const float error = single_error<Extremes>(v, low, high, range);
                if (error < best.error) {
                    best = {low, high, error};
                }
            }
        }
        if (best.low == start.low && best.high == start.high) {
            return;
        }
    }
}

// v: sixteen values in code units within the range. out: 8 bytes.
PARADIZE_INLINE void encode_single(const Lanes &v, CodeRange range, std::uint8_t *out) {
    const float width = range.top - range.bottom;
    const float low = smallest(v);
    const float high = largest(v);
    Endpoints plain{rounded(low - range.bottom, width) + range.bottom,
                    rounded(high - range.bottom, width) + range.bottom, 0.0F};
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
        descend<false>(v, range, 4, plain);
    }
    // The other mode: six values and the ends of the range, for blocks that touch the ends.
    bool extremes = false;
    Endpoints spread{range.top, range.bottom, 0.0F};
    if (plain.error > 0.0F && (low < range.bottom + 0.5F || high > range.top - 0.5F)) {
        for (std::size_t i = 0; i < texels; ++i) {
            if (v[i] >= range.bottom + 0.5F && v[i] <= range.top - 0.5F) {
                spread.low = v[i] < spread.low ? v[i] : spread.low;
                spread.high = v[i] > spread.high ? v[i] : spread.high;
            }
        }
        if (spread.low > spread.high) { // nothing but ends
            spread.low = spread.high = range.bottom;
        }
        spread.low = rounded(spread.low - range.bottom, width) + range.bottom;
        spread.high = rounded(spread.high - range.bottom, width) + range.bottom;
        spread.error = single_error<true>(v, spread.low, spread.high, range);
        if (spread.error < 4.0F * plain.error) {
            descend<true>(v, range, 3, spread);
        }
        extremes = spread.error < plain.error;
    }

    const Endpoints best = extremes ? spread : plain;
    const float steps = extremes ? 5.0F : 7.0F;
    const float to_step = best.high > best.low ? steps / (best.high - best.low) : 0.0F;
    const float from_step = (best.high - best.low) / steps;
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < texels; ++i) {
        const float q = rounded((v[i] - best.low) * to_step, steps);
        const auto step = static_cast<std::uint64_t>(q);
        std::uint64_t index = 0;
        if (!extremes) { // stored high first: 0 is high, 1 is low, 2..7 go from high to low
            index = step == 7 ? 0 : (step == 0 ? 1 : 8 - step);
        } else { // stored low first: 0 is low, 1 is high, 2..5 go from low to high, 6 and 7 are the ends
            index = step == 0 ? 0 : (step == 5 ? 1 : step + 1);
            const float d = v[i] - (best.low + q * from_step);
            const float bottom = v[i] - range.bottom;
            const float top = v[i] - range.top;
            if (bottom * bottom < d * d && bottom * bottom <= top * top) {
                index = 6;
            } else if (top * top < d * d) {
                index = 7;
            }
        }
        bits |= index << (3 * i);
    }
    out[0] = static_cast<std::uint8_t>(static_cast<int>(extremes ? best.low : best.high));
    out[1] = static_cast<std::uint8_t>(static_cast<int>(extremes ? best.high : best.low));
    for (std::size_t i = 0; i < 6; ++i) {
        out[2 + i] = static_cast<std::uint8_t>(bits >> (8 * i));
    }
}

} // namespace paradize::bcn
