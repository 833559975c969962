// The colours of a block (BC1): two 5:6:5 ends and one of four places between them for every texel.
#pragma once

#include "bcn/encode.hpp"
#include "bcn/lanes.hpp"

namespace paradize::bcn::PARADIZE_WIDTH {

constexpr float code_top[3] = {31.0F, 63.0F, 31.0F};
constexpr float code_unit[3] = {255.0F / 31.0F, 255.0F / 63.0F, 255.0F / 31.0F};

// Texels less their block's mean, in 8-bit codes; the sum of their squares.
struct ColorBlocks {
    Lanes v[3][texels];
    Lanes mean[3];
    Lanes square;
};

// Two ends, a point of color space each: codes 0..31, 0..63, 0..31, or texel values less the mean.
struct Endpoints {
    Lanes a[3];
    Lanes b[3];
};

// The sums of a choice of places (0 at b, 3 at a): with each other and with the texels.
struct Places {
    Lanes q;
    Lanes qq;
    Lanes qv[3];
    Lanes error; // squared, of the ends that the places were chosen for
    Lanes worst; // the largest difference of a channel of a texel
};

// limit: the worst that a fit to come may leave.
struct ColorFit {
    Endpoints codes;
    Lanes error;
    Lanes worst;
    Lanes limit;
};

PARADIZE_INLINE void centred(const ColorBlocks &blocks, const Endpoints &codes, Endpoints &out) {
    for (int k = 0; k < 3; ++k) {
        out.a[k] = codes.a[k] * code_unit[k] - blocks.mean[k];
        out.b[k] = codes.b[k] * code_unit[k] - blocks.mean[k];
    }
}

// The line that places texels: place = clamped(sum of v * weight - offset).
struct ProjectionAxis {
    Lanes weight[3];
    Lanes offset;
};

PARADIZE_INLINE void make_ruler(const Endpoints &ends, ProjectionAxis &ruler) {
    const Lanes r = ends.a[0] - ends.b[0];
    const Lanes g = ends.a[1] - ends.b[1];
    const Lanes b = ends.a[2] - ends.b[2];
    const Lanes square = r * r + g * g + b * b;
    const Lanes scale = square > Lanes{} ? 3.0F / (square > Lanes{} ? square : splat(1.0F)) : Lanes{};
    ruler.weight[0] = r * scale;
    ruler.weight[1] = g * scale;
    ruler.weight[2] = b * scale;
    ruler.offset = ends.b[0] * ruler.weight[0] + ends.b[1] * ruler.weight[1] + ends.b[2] * ruler.weight[2];
}

PARADIZE_INLINE Lanes along(const ColorBlocks &blocks, const ProjectionAxis &ruler, std::size_t i) {
    return clamped(blocks.v[0][i] * ruler.weight[0] + blocks.v[1][i] * ruler.weight[1] +
                       blocks.v[2][i] * ruler.weight[2] - ruler.offset,
                   3.0F);
}

// The nearest place of every texel between two ends, and what is left. Bounded: whether the worst is asked
// for; else it is 0.
template <bool Bounded>
PARADIZE_STEP void place(const ColorBlocks &blocks, const Endpoints &ends, Places &places) {
    ProjectionAxis ruler;
    make_ruler(ends, ruler);
    Lanes step[3];
    for (int k = 0; k < 3; ++k) {
        step[k] = (ends.a[k] - ends.b[k]) * (1.0F / 3.0F);
    }
    Lanes q_sum = {}, qq = {}, qr = {}, qg = {}, qb = {}, worst = {};
    for (std::size_t i = 0; i < texels; ++i) {
        const Lanes q = nearest(along(blocks, ruler, i));
        q_sum += q;
        qq += q * q;
        qr += q * blocks.v[0][i];
        qg += q * blocks.v[1][i];
        qb += q * blocks.v[2][i];
        if constexpr (Bounded) {
            for (int k = 0; k < 3; ++k) {
                worst = most(worst, absolute(blocks.v[k][i] - (ends.b[k] + q * step[k])));
            }
        }
    }
    places.q = q_sum;
    places.qq = qq;
    places.qv[0] = qr;
    places.qv[1] = qg;
    places.qv[2] = qb;
    // The texels' own sum is zero, which leaves the squares and what the places meet.
    Lanes error = blocks.square;
    for (int k = 0; k < 3; ++k) {
        error += step[k] * (step[k] * qq - 2.0F * places.qv[k]) +
                 ends.b[k] * (2.0F * step[k] * q_sum + 16.0F * ends.b[k]);
    }
    places.error = error;
    places.worst = worst;
}

// Codes whose point two thirds from b to a is nearest to one value: a third of a code apart, ends adjacent.
PARADIZE_INLINE void solid_codes(const Lanes &value, int k, Lanes &a, Lanes &b) {
    const Lanes thirds = nearest(clamped(value * (3.0F / code_unit[k]), 3.0F * code_top[k]));
    a = nearest(thirds * (1.0F / 3.0F));
    b = thirds - 2.0F * a;
}

// Ends by least squares for the places that the texels have, both rounded to codes together: for each of the
// codes about the best a, the b that then is best. Where the places are all one: the nearest of one colour.
template <int Options>
PARADIZE_STEP void refit(const ColorBlocks &blocks, const Places &places, Endpoints &codes) {
    const Lanes determinant = places.qq * 16.0F - places.q * places.q;
    const auto spread = determinant > 0.5F;
    const Lanes inverse = 16.0F / (spread ? determinant : splat(1.0F));
    // Sums of the weights of a (place / 3) and of b.
    const Lanes aa = places.qq * (1.0F / 9.0F);
    const Lanes ab = places.q * (1.0F / 3.0F) - aa;
    const Lanes bb = 16.0F - places.q * (2.0F / 3.0F) + aa;
    const Lanes lean = ab / (spread ? bb : splat(1.0F));
    const Lanes left = aa - ab * lean; // of the error, where b follows a
    for (int k = 0; k < 3; ++k) {
        const Lanes step = places.qv[k] * inverse;
        const Lanes start = blocks.mean[k] - step * places.q * (1.0F / 16.0F);
        const Lanes best_b = start * (1.0F / code_unit[k]);
        const Lanes best_a = (start + step * 3.0F) * (1.0F / code_unit[k]);
        const Lanes first = floored(least(most(best_a, splat(-4.0F)), splat(code_top[k] + 4.0F)));
        Lanes least_error = splat(1e30F);
        Lanes a = {}, b = {};
        for (int option = 0; option < Options; ++option) {
            const Lanes try_a = clamped(first + static_cast<float>(option - (Options - 2) / 2), code_top[k]);
            const Lanes off_a = try_a - best_a;
            const Lanes follow = best_b - lean * off_a;
            const Lanes try_b = nearest(clamped(follow, code_top[k]));
            const Lanes off_b = try_b - follow;
            const Lanes error = left * (off_a * off_a) + bb * (off_b * off_b);
            const auto better = error < least_error;
            least_error = better ? error : least_error;
            a = better ? try_a : a;
            b = better ? try_b : b;
        }
        codes.a[k] = a;
        codes.b[k] = b;
    }
    if (any(~spread)) {
        for (int k = 0; k < 3; ++k) {
            Lanes a, b;
            solid_codes(blocks.mean[k], k, a, b);
            codes.a[k] = spread ? codes.a[k] : a;
            codes.b[k] = spread ? codes.b[k] : b;
        }
    }
}

// Takes ends that leave less, where no texel is farther off than `limit` allows.
PARADIZE_INLINE void keep(const Endpoints &codes, const Places &places, ColorFit &best) {
    const auto better = (places.error < best.error) & (places.worst <= best.limit);
    for (int k = 0; k < 3; ++k) {
        best.codes.a[k] = better ? codes.a[k] : best.codes.a[k];
        best.codes.b[k] = better ? codes.b[k] : best.codes.b[k];
    }
    best.error = better ? places.error : best.error;
    best.worst = better ? places.worst : best.worst;
}

// The direction of the largest variance: the covariance to its eighth power, whose columns all point there.
PARADIZE_STEP void principal_axis(const ColorBlocks &blocks, Lanes (&axis)[3]) {
    Lanes rr = {}, rg = {}, rb = {}, gg = {}, gb = {}, bb = {};
    for (std::size_t i = 0; i < texels; ++i) {
        const Lanes r = blocks.v[0][i], g = blocks.v[1][i], b = blocks.v[2][i];
        rr += r * r;
        rg += r * g;
        rb += r * b;
        gg += g * g;
        gb += g * b;
        bb += b * b;
    }
    const Lanes trace = rr + gg + bb;
    const Lanes scale = trace > Lanes{} ? 1.0F / (trace > Lanes{} ? trace : splat(1.0F)) : Lanes{};
    rr *= scale, rg *= scale, rb *= scale, gg *= scale, gb *= scale, bb *= scale;
    for (int turn = 0; turn < 3; ++turn) {
        const Lanes a = rr * rr + rg * rg + rb * rb, b = rr * rg + rg * gg + rb * gb;
        const Lanes c = rr * rb + rg * gb + rb * bb, d = rg * rg + gg * gg + gb * gb;
        const Lanes e = rg * rb + gg * gb + gb * bb, f = rb * rb + gb * gb + bb * bb;
        rr = a, rg = b, rb = c, gg = d, gb = e, bb = f;
    }
    const auto red = rr > gg;
    const Lanes top = red ? rr : gg;
    const auto blue = bb > top;
    axis[0] = blue ? rb : (red ? rr : rg);
    axis[1] = blue ? gb : (red ? rg : gg);
    axis[2] = blue ? bb : (red ? rb : gb);
}

// The outermost texels along an axis through the mean.
PARADIZE_STEP void axis_ends(const ColorBlocks &blocks, const Lanes (&axis)[3], Endpoints &ends) {
    Lanes low = splat(1e30F), high = splat(-1e30F);
    for (std::size_t i = 0; i < texels; ++i) {
        const Lanes t = blocks.v[0][i] * axis[0] + blocks.v[1][i] * axis[1] + blocks.v[2][i] * axis[2];
        low = least(low, t);
        high = most(high, t);
    }
    const Lanes square = axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2];
    const Lanes scale = square > Lanes{} ? 1.0F / (square > Lanes{} ? square : splat(1.0F)) : Lanes{};
    low *= scale;
    high *= scale;
    for (int k = 0; k < 3; ++k) {
        ends.a[k] = axis[k] * high;
        ends.b[k] = axis[k] * low;
    }
}

} // namespace paradize::bcn::PARADIZE_WIDTH
