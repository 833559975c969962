// The colour of a block (BC1): two 5:6:5 endpoints and one of four places between them for every texel.
#pragma once

#include "bcn_lanes.hpp"

#include <array>
#include <cstdint>

namespace paradize::bcn {

using Color = std::array<float, 3>; // 0..255
using Packed = std::array<int, 3>;  // 0..31, 0..63, 0..31

inline constexpr std::array<float, 3> channel_top = {31.0F, 63.0F, 31.0F};

struct ColorBlock {
    std::array<Lanes, 3> v; // 0..255
};

PARADIZE_INLINE Packed pack(const Color &c) {
    Packed p;
    for (std::size_t k = 0; k < 3; ++k) {
        p[k] = static_cast<int>(rounded(c[k] * (channel_top[k] / 255.0F), channel_top[k]));
    }
    return p;
}

PARADIZE_INLINE Color unpack(const Packed &p) {
    Color c;
    for (std::size_t k = 0; k < 3; ++k) {
        c[k] = static_cast<float>(p[k]) * (255.0F / channel_top[k]);
    }
    return c;
}

// The place 0..3 of every texel between b (0) and a (3), and the squared error that is left.
PARADIZE_INLINE float place(const ColorBlock &block, const Color &a, const Color &b, Lanes &q) {
    Color d;
    for (std::size_t k = 0; k < 3; ++k) {
        d[k] = a[k] - b[k];
    }
    const float square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    const float to_step = square > 0.0F ? 3.0F / square : 0.0F;
    Lanes error;
    for (std::size_t i = 0; i < texels; ++i) {
        const float along =
            (block.v[0][i] - b[0]) * d[0] + (block.v[1][i] - b[1]) * d[1] + (block.v[2][i] - b[2]) * d[2];
        const float step = rounded(along * to_step, 3.0F);
        q[i] = step;
        const float t = step * (1.0F / 3.0F);
        const float e0 = block.v[0][i] - (b[0] + t * d[0]);
        const float e1 = block.v[1][i] - (b[1] + t * d[1]);
        const float e2 = block.v[2][i] - (b[2] + t * d[2]);
        error[i] = e0 * e0 + e1 * e1 + e2 * e2;
    }
    return sum(error);
}

struct ColorFit {
    Packed a{};
    Packed b{};
    Lanes q{}; // 0 at b, 3 at a
    float error = 0.0F;
};

PARADIZE_INLINE void measure(const ColorBlock &block, ColorFit &fit) {
    fit.error = place(block, unpack(fit.a), unpack(fit.b), fit.q);
}

// Endpoints by least squares for the places that the texels have; false where the places do not determine
// them.
PARADIZE_INLINE bool refit(const ColorBlock &block, const Lanes &q, Color &a, Color &b) {
    Lanes t;
    Lanes tt;
    for (std::size_t i = 0; i < texels; ++i) {
        t[i] = q[i] * (1.0F / 3.0F);
        tt[i] = t[i] * t[i];
    }
    const float n = static_cast<float>(texels);
    const float st = sum(t);
    const float determinant = n * sum(tt) - st * st;
    if (!(determinant > 1e-3F)) {
        return false;
    }
    for (std::size_t k = 0; k < 3; ++k) {
        Lanes tv;
        for (std::size_t i = 0; i < texels; ++i) {
            tv[i] = t[i] * block.v[k][i];
        }
        const float sv = sum(block.v[k]);
        const float slope = (n * sum(tv) - st * sv) / determinant;
        b[k] = (sv - slope * st) / n;
        a[k] = b[k] + slope;
    }
    return true;
}

// The direction of largest variance through the mean, by power iteration from the channel that varies most.
PARADIZE_INLINE void principal_ends(const ColorBlock &block, Color &a, Color &b) {
    Color mean;
    std::array<Lanes, 3> d;
    for (std::size_t k = 0; k < 3; ++k) {
        mean[k] = sum(block.v[k]) * (1.0F / static_cast<float>(texels));
        for (std::size_t i = 0; i < texels; ++i) {
            d[k][i] = block.v[k][i] - mean[k];
        }
    }
    std::array<Color, 3> covariance;
    for (std::size_t j = 0; j < 3; ++j) {
        for (std::size_t k = j; k < 3; ++k) {
            Lanes product;
            for (std::size_t i = 0; i < texels; ++i) {
                product[i] = d[j][i] * d[k][i];
            }
            covariance[j][k] = covariance[k][j] = sum(product);
        }
    }
    std::size_t widest = 1;
    widest = covariance[0][0] > covariance[widest][widest] ? 0 : widest;
    widest = covariance[2][2] > covariance[widest][widest] ? 2 : widest;
    Color axis = covariance[widest];
    for (int turn = 0; turn < 6; ++turn) {
        Color next;
        float peak = 0.0F;
        for (std::size_t k = 0; k < 3; ++k) {
            next[k] = covariance[k][0] * axis[0] + covariance[k][1] * axis[1] + covariance[k][2] * axis[2];
            const float size = next[k] < 0.0F ? -next[k] : next[k];
            peak = size > peak ? size : peak;
        }
        if (!(peak > 1e-12F)) {
            break;
        }
        for (std::size_t k = 0; k < 3; ++k) {
            axis[k] = next[k] / peak;
        }
    }
    const float square = axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2];
    Lanes along;
    for (std::size_t i = 0; i < texels; ++i) {
        along[i] = d[0][i] * axis[0] + d[1][i] * axis[1] + d[2][i] * axis[2];
    }
    const float scale = square > 0.0F ? 1.0F / square : 0.0F;
    const float low = smallest(along) * scale;
    const float high = largest(along) * scale;
    for (std::size_t k = 0; k < 3; ++k) {
        a[k] = mean[k] + axis[k] * high;
        b[k] = mean[k] + axis[k] * low;
    }
}

// For a block of one colour: the endpoints of a channel whose place two thirds along is nearest, per 8-bit
// code.
struct SolidTables {
    struct Pair {
        std::uint8_t a;
        std::uint8_t b;
    };
    std::array<std::array<Pair, 256>, 2> pairs{}; // of 5 and of 6 bits

    SolidTables() {
        for (std::size_t bits = 0; bits < 2; ++bits) {
            const int top = bits == 0 ? 31 : 63;
            for (int code = 0; code < 256; ++code) {
                float best = 1e9F;
                for (int a = 0; a <= top; ++a) {
                    for (int b = 0; b <= top; ++b) {
                        const float value = static_cast<float>(2 * a + b) * (85.0F / static_cast<float>(top));
                        const float off = value - static_cast<float>(code);
                        const float spread =
                            static_cast<float>(a > b ? a - b : b - a); // decoders agree best on near ends
                        const float error = off * off + spread * 1e-3F;
                        if (error < best) {
                            best = error;
                            pairs[bits][static_cast<std::size_t>(code)] = {static_cast<std::uint8_t>(a),
                                                                           static_cast<std::uint8_t>(b)};
                        }
                    }
                }
            }
        }
    }
};

inline const SolidTables &solid_tables() {
    static const SolidTables tables;
    return tables;
}

// out: 8 bytes, four-colour mode.
PARADIZE_INLINE void encode_color(const ColorBlock &block, const SolidTables &solid, std::uint8_t *out) {
    ColorFit best;
    bool flat = true;
    for (std::size_t k = 0; k < 3; ++k) {
        flat = flat && smallest(block.v[k]) == largest(block.v[k]);
    }
    if (flat) {
        for (std::size_t k = 0; k < 3; ++k) {
            const auto pair = solid.pairs[k == 1 ? 1 : 0][static_cast<std::size_t>(block.v[k][0])];
            best.a[k] = pair.a;
            best.b[k] = pair.b;
        }
        best.q.fill(2.0F);
    } else {
        Color a;
        Color b;
        principal_ends(block, a, b);
        best.a = pack(a);
        best.b = pack(b);
        measure(block, best);
        for (int turn = 0; turn < 3; ++turn) { // least squares until it gains nothing
            ColorFit next;
            if (!refit(block, best.q, a, b)) {
                break;
            }
            next.a = pack(a);
            next.b = pack(b);
            measure(block, next);
            if (!(next.error < best.error)) {
                break;
            }
            best = next;
        }
        for (int pass = 0; pass < 2; ++pass) { // then every channel of each end, one code up and down
            const float before = best.error;
            for (std::size_t k = 0; k < 6; ++k) {
                for (const int step : {-1, 1}) {
                    ColorFit next = best;
                    int &code = k < 3 ? next.a[k] : next.b[k - 3];
                    code += step;
                    if (code < 0 || code > static_cast<int>(channel_top[k % 3])) {
                        continue;
                    }
                    measure(block, next);
                    if (next.error < best.error) {
                        best = next;
                    }
                }
            }
            if (!(best.error < before)) {
                break;
            }
        }
    }

    unsigned first = static_cast<unsigned>(best.a[0] << 11 | best.a[1] << 5 | best.a[2]);
    unsigned second = static_cast<unsigned>(best.b[0] << 11 | best.b[1] << 5 | best.b[2]);
    const bool swapped = first < second;
    const bool same = first == second;
    if (swapped) {
        const unsigned held = first;
        first = second;
        second = held;
    }
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < texels; ++i) { // stored: 0 first, 1 second, 2 a third on, 3 two thirds on
        const int step = swapped ? static_cast<int>(best.q[i]) : 3 - static_cast<int>(best.q[i]);
        const std::uint32_t index =
            same || step == 0 ? 0U : (step == 3 ? 1U : static_cast<std::uint32_t>(step) + 1U);
        bits |= index << (2 * i);
    }
    out[0] = static_cast<std::uint8_t>(first);
    out[1] = static_cast<std::uint8_t>(first >> 8);
    out[2] = static_cast<std::uint8_t>(second);
    out[3] = static_cast<std::uint8_t>(second >> 8);
    for (std::size_t i = 0; i < 4; ++i) {
        out[4 + i] = static_cast<std::uint8_t>(bits >> (8 * i));
    }
}

} // namespace paradize::bcn
