// The colour of a block (BC1): two 5:6:5 endpoints and one of four places between them for every texel.
#pragma once

#include "bcn_lanes.hpp"
#include "bcn_solid.hpp"

namespace paradize::bcn::PARADIZE_WIDTH {

struct Color {
    float v[3]; // 0..255
};

struct Packed {
    int v[3]; // 0..31, 0..63, 0..31
};

struct ColorBlock {
    Lanes v[3]; // 0..255
};

PARADIZE_INLINE float top_of(int channel) {
    return channel == 1 ? 63.0F : 31.0F;
}

PARADIZE_INLINE Packed pack(const Color &c) {
    Packed p;
    for (int k = 0; k < 3; ++k) {
        p.v[k] = static_cast<int>(rounded(c.v[k] * (top_of(k) / 255.0F), top_of(k)));
    }
    return p;
}

PARADIZE_INLINE Color unpack(const Packed &p) {
    Color c;
    for (int k = 0; k < 3; ++k) {
        c.v[k] = static_cast<float>(p.v[k]) * (255.0F / top_of(k));
    }
    return c;
}

struct ColorFit {
    Packed a;
    Packed b;
    Lanes q; // place of each texel: 0 at b, 3 at a
    float error;
};

// The place of every texel between the ends, and the squared error that is left.
PARADIZE_INLINE void measure(const ColorBlock &block, ColorFit &fit) {
    const Color a = unpack(fit.a);
    const Color b = unpack(fit.b);
    Color d;
    for (int k = 0; k < 3; ++k) {
        d.v[k] = a.v[k] - b.v[k];
    }
    const float square = d.v[0] * d.v[0] + d.v[1] * d.v[1] + d.v[2] * d.v[2];
    const float to_step = square > 0.0F ? 3.0F / square : 0.0F;
    const Lanes r = block.v[0] - b.v[0];
    const Lanes g = block.v[1] - b.v[1];
    const Lanes l = block.v[2] - b.v[2];
    rounded((r * d.v[0] + g * d.v[1] + l * d.v[2]) * to_step, 3.0F, fit.q);
    const Lanes t = fit.q * (1.0F / 3.0F);
    const Lanes er = r - t * d.v[0];
    const Lanes eg = g - t * d.v[1];
    const Lanes el = l - t * d.v[2];
    fit.error = sum(er * er + eg * eg + el * el);
}

// Endpoints by least squares for the places that the texels have; false where the places do not determine
// them.
PARADIZE_INLINE bool refit(const ColorBlock &block, const Lanes &q, Color &a, Color &b) {
    const Lanes t = q * (1.0F / 3.0F);
    const float n = static_cast<float>(texels);
    const float st = sum(t);
    const float determinant = n * sum(t * t) - st * st;
    if (!(determinant > 1e-3F)) {
        return false;
    }
    for (int k = 0; k < 3; ++k) {
        const float sv = sum(block.v[k]);
        const float slope = (n * sum(t * block.v[k]) - st * sv) / determinant;
        b.v[k] = (sv - slope * st) / n;
        a.v[k] = b.v[k] + slope;
    }
    return true;
}

// The direction of largest variance through the mean, by power iteration from the channel that varies most.
PARADIZE_INLINE void principal_ends(const ColorBlock &block, Color &a, Color &b) {
    Color mean;
    Lanes d[3];
    for (int k = 0; k < 3; ++k) {
        mean.v[k] = sum(block.v[k]) * (1.0F / static_cast<float>(texels));
        d[k] = block.v[k] - mean.v[k];
    }
    float covariance[3][3];
    for (int j = 0; j < 3; ++j) {
        for (int k = j; k < 3; ++k) {
            covariance[j][k] = covariance[k][j] = sum(d[j] * d[k]);
        }
    }
    int widest = 1;
    widest = covariance[0][0] > covariance[widest][widest] ? 0 : widest;
    widest = covariance[2][2] > covariance[widest][widest] ? 2 : widest;
    float axis[3] = {covariance[widest][0], covariance[widest][1], covariance[widest][2]};
    for (int turn = 0; turn < 6; ++turn) {
        float next[3];
        float peak = 0.0F;
        for (int k = 0; k < 3; ++k) {
            next[k] = covariance[k][0] * axis[0] + covariance[k][1] * axis[1] + covariance[k][2] * axis[2];
            const float size = next[k] < 0.0F ? -next[k] : next[k];
            peak = size > peak ? size : peak;
        }
        if (!(peak > 1e-12F)) {
            break;
        }
        for (int k = 0; k < 3; ++k) {
            axis[k] = next[k] / peak;
        }
    }
    const float square = axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2];
    const Lanes along = d[0] * axis[0] + d[1] * axis[1] + d[2] * axis[2];
    const float scale = square > 0.0F ? 1.0F / square : 0.0F;
    const float low = smallest(along) * scale;
    const float high = largest(along) * scale;
    for (int k = 0; k < 3; ++k) {
        a.v[k] = mean.v[k] + axis[k] * high;
        b.v[k] = mean.v[k] + axis[k] * low;
    }
}

// Principal axis, then least squares until it gains nothing, then `passes` times every channel of each end
// one code up and down.
PARADIZE_INLINE void fit_ends(const ColorBlock &block, int passes, ColorFit &best) {
    Color a;
    Color b;
    principal_ends(block, a, b);
    best.a = pack(a);
    best.b = pack(b);
    measure(block, best);
    for (int turn = 0; turn < 3 && refit(block, best.q, a, b); ++turn) {
        ColorFit next;
        next.a = pack(a);
        next.b = pack(b);
        measure(block, next);
        if (!(next.error < best.error)) {
            break;
        }
        best = next;
    }
    for (int pass = 0; pass < passes; ++pass) {
        const float before = best.error;
        for (int k = 0; k < 12; ++k) {
            ColorFit next = best;
            int &code = k < 6 ? next.a.v[k / 2] : next.b.v[k / 2 - 3];
            code += k % 2 == 0 ? -1 : 1;
            if (code < 0 || code > static_cast<int>(top_of(k / 2 % 3))) {
                continue;
            }
            measure(block, next);
            if (next.error < best.error) {
                best = next;
            }
        }
        if (!(best.error < before)) {
            return;
        }
    }
}

// passes: of the search around the endpoints. out: 8 bytes, four-colour mode.
PARADIZE_INLINE void encode_color(const ColorBlock &block, const SolidTables &solid, int passes,
                                  std::uint8_t *out) {
    ColorFit best;
    bool flat = true;
    for (int k = 0; k < 3; ++k) {
        flat = flat && smallest(block.v[k]) == largest(block.v[k]);
    }
    if (flat) {
        for (int k = 0; k < 3; ++k) {
            const SolidPair pair = solid.pairs[k == 1 ? 1 : 0][static_cast<int>(block.v[k][0])];
            best.a.v[k] = pair.a;
            best.b.v[k] = pair.b;
        }
        best.q = Lanes{} + 2.0F;
    } else {
        fit_ends(block, passes, best);
    }
    const unsigned a = static_cast<unsigned>(best.a.v[0] << 11 | best.a.v[1] << 5 | best.a.v[2]);
    const unsigned b = static_cast<unsigned>(best.b.v[0] << 11 | best.b.v[1] << 5 | best.b.v[2]);
    const bool swapped = a < b;
    const unsigned first = swapped ? b : a;
    const unsigned second = swapped ? a : b;
    const Whole place = __builtin_convertvector(best.q, Whole);
    const Whole step = swapped ? place : 3 - place; // thirds from the first end on
    const Whole zero = {};
    // Stored: 0 first, 1 second, 2 a third on, 3 two thirds on.
    Whole index = step == 0 ? zero : (step == 3 ? zero + 1 : step + 1);
    if (a == b) {
        index = zero;
    }
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < texels; ++i) {
        bits |= static_cast<std::uint32_t>(index[i]) << (2 * i);
    }
    out[0] = static_cast<std::uint8_t>(first);
    out[1] = static_cast<std::uint8_t>(first >> 8);
    out[2] = static_cast<std::uint8_t>(second);
    out[3] = static_cast<std::uint8_t>(second >> 8);
    for (std::size_t i = 0; i < 4; ++i) {
        out[4 + i] = static_cast<std::uint8_t>(bits >> (8 * i));
    }
}

} // namespace paradize::bcn::PARADIZE_WIDTH
