// Two channels that are x and y of unit vectors (BC5 SNORM): the tiers of both meet by the angles that they
// leave, of which the channels know nothing: where z is small, an error of x or y turns the vector farther.
#pragma once

#include "bcn/single_fit.hpp"

namespace paradize::bcn::PARADIZE_WIDTH {

// Unit vectors of a block's texels.
struct Vectors {
    Lanes x[texels];
    Lanes y[texels];
    Lanes z[texels];
};

// Lengths of the chords between shown and true vectors, which grow with the angles.
struct Chords {
    Lanes sum;
    Lanes square;
    Lanes worst;
    Lanes rounding;       // of the sum: near the rim, where z is small, an error of z^2 is a large one of z
    Lanes rounding_worst; // of any chord
};

// The vector that shaders rebuild: z from x and y, then of length 1.
PARADIZE_INLINE void rebuild(Lanes x, Lanes y, Vectors &out, std::size_t i) {
    constexpr float unit = 1.0F / 127.0F;
    x *= unit;
    y *= unit;
    const Lanes flat = x * x + y * y;
    const Lanes shrink = 1.0F / root(most(flat, splat(1.0F)));
    out.x[i] = x * shrink;
    out.y[i] = y * shrink;
    out.z[i] = root(most(1.0F - flat, Lanes{}));
}

// The codes of every texel that a fit shows.
PARADIZE_STEP void show(const ValueBlocks &blocks, CodeRange range, const ValueFit &fit,
                        Lanes (&out)[texels]) {
    const Lanes steps = fit.six ? splat(5.0F) : splat(7.0F);
    const Lanes low = fit.low - blocks.mean;
    const Lanes width = fit.high - fit.low;
    const auto wide = width > Lanes{};
    const Lanes scale = wide ? steps / (wide ? width : splat(1.0F)) : Lanes{};
    const Lanes offset = low * scale;
    const Lanes step = width * (fit.six ? splat(1.0F / 5.0F) : splat(1.0F / 7.0F));
    const Lanes bottom = range.bottom - blocks.mean;
    const Lanes top = range.top - blocks.mean;
    for (std::size_t i = 0; i < texels; ++i) {
        const Lanes v = blocks.v[i];
        const Lanes between = low + nearest(within(v * scale - offset, Lanes{}, steps)) * step;
        const Lanes end = v - bottom <= top - v ? bottom : top;
        const auto at_end = fit.six & (absolute(v - end) < absolute(v - between));
        out[i] = (at_end ? end : between) + blocks.mean;
    }
}

PARADIZE_STEP void compare(const Lanes (&x)[texels], const Lanes (&y)[texels], const Vectors &truth,
                           Chords &chords) {
    constexpr float of_square = 0x1p-22F; // error of z^2
    constexpr float least_z = 0x1p-11F;   // its root
    chords.sum = chords.square = chords.worst = chords.rounding = chords.rounding_worst = Lanes{};
    for (std::size_t i = 0; i < texels; ++i) {
        Vectors shown;
        rebuild(x[i], y[i], shown, i);
        const Lanes dx = shown.x[i] - truth.x[i];
        const Lanes dy = shown.y[i] - truth.y[i];
        const Lanes dz = shown.z[i] - truth.z[i];
        const Lanes square = dx * dx + dy * dy + dz * dz;
        const Lanes chord = root(square);
        chords.sum += chord;
        chords.square += square;
        chords.worst = most(chords.worst, chord);
        const Lanes rounding = of_square / most(least(shown.z[i], truth.z[i]), splat(least_z));
        chords.rounding += rounding;
        chords.rounding_worst = most(chords.rounding_worst, rounding);
    }
}

PARADIZE_INLINE void choose(const IntLanes &better, const ValueFit &from, ValueFit &to) {
    to.low = better ? from.low : to.low;
    to.high = better ? from.high : to.high;
    to.six = better ? from.six : to.six;
}

// Of all pairs of the tiers' results, tier by tier, the pair that leaves the least angle on average and
// nothing that is worse than the pair of the tier below, by more than rounding can pretend.
PARADIZE_STEP void encode_vectors(ValueBlocks (&blocks)[2], CodeRange range, Quality quality,
                                  IntLanes (&stored)[4]) {
    Vectors truth;
    for (std::size_t i = 0; i < texels; ++i) {
        rebuild(blocks[0].v[i], blocks[1].v[i], truth, i);
    }
    const int last = static_cast<int>(quality);
    ValueFit tiers[2][3];
    Lanes shown[2][3][texels];
    for (int c = 0; c < 2; ++c) {
        centre(blocks[c]);
        fit_single(blocks[c], range, quality, tiers[c]);
        for (int t = 0; t <= last; ++t) {
            show(blocks[c], range, tiers[c][t], shown[c][t]);
        }
    }
    ValueFit best[2] = {tiers[0][0], tiers[1][0]};
    Chords least_left;
    compare(shown[0][0], shown[1][0], truth, least_left);
    for (int t = 1; t <= last; ++t) {
        const Chords limit = least_left;
        for (int pair = 0; pair < (t + 1) * (t + 1); ++pair) {
            const int x = pair / (t + 1), y = pair % (t + 1);
            if (x < t && y < t) {
                continue; // was tried at a tier below
            }
            Chords chords;
            compare(shown[0][x], shown[1][y], truth, chords);
            const auto no_worse = (chords.worst == limit.worst) | (chords.worst + chords.rounding_worst <=
                                                                   limit.worst - limit.rounding_worst);
            const auto better = (chords.sum + chords.rounding < least_left.sum - least_left.rounding) &
                                (chords.square <= limit.square) & no_worse;
            choose(better, tiers[0][x], best[0]);
            choose(better, tiers[1][y], best[1]);
            least_left.sum = better ? chords.sum : least_left.sum;
            least_left.square = better ? chords.square : least_left.square;
            least_left.worst = better ? chords.worst : least_left.worst;
            least_left.rounding = better ? chords.rounding : least_left.rounding;
            least_left.rounding_worst = better ? chords.rounding_worst : least_left.rounding_worst;
        }
    }
    for (int c = 0; c < 2; ++c) {
        pack_single(blocks[c], range, best[c], stored[2 * c], stored[2 * c + 1]);
    }
}

} // namespace paradize::bcn::PARADIZE_WIDTH
