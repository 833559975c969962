// Rows of codes of heights, gloss and du/dv, compiled once per instruction set: include after
// normals/rows.hpp.
#pragma once

#include "normals/rows.hpp"

namespace paradize::normals::PARADIZE_WIDTH {

typedef double Wide __attribute__((vector_size(8 * PARADIZE_LANES)));

// In double, as PNG files of heights are written: float would round twice.
PARADIZE_INLINE Pairs height_lanes(const Lanes &h) {
    const Wide code = __builtin_convertvector(h, Wide) * 65535.0 + 0.5;
    return __builtin_convertvector(__builtin_convertvector(code, Whole), Pairs);
}

static void height_codes(const float *heights, std::size_t n, std::uint8_t *to) {
    for (std::size_t x = 0; x < n; x += lanes) {
        const Pairs codes = height_lanes(load(heights + x));
        std::memcpy(to + 2 * x, &codes, sizeof(codes));
    }
}

// Into 0..1. (In place: vectors wider than the instruction set's are not returned alike everywhere.)
template <typename Vector>
PARADIZE_INLINE void unit(Vector &v) {
    const Vector zero = {};
    const Vector one = zero + 1;
    v = v < zero ? zero : v;
    v = v > one ? one : v;
}

static void apply_levels(const float *values, std::size_t n, const Linear &line, float *to) {
    for (std::size_t x = 0; x < n; x += lanes) {
        const Wide v = __builtin_convertvector(load(values + x), Wide);
        Wide t = (v - line.black) / line.range;
        unit(t);
        t = (t - 0.5) * line.contrast + 0.5 + line.brightness;
        unit(t);
        t = line.invert ? 1.0 - t : t;
        store(to + x, __builtin_convertvector(t, Lanes));
    }
}

PARADIZE_INLINE Whole byte_code(Lanes v) {
    unit(v);
    return __builtin_convertvector(v * 255.0F + 0.5F, Whole);
}

static void gloss_codes(const float *t, std::size_t n, const float *low, const float *step,
                        std::uint8_t *to) {
    for (std::size_t x = 0; x < n; x += lanes) {
        const Lanes v = load(t + x);
        const Whole first = byte_code(low[0] + v * step[0]);
        const Whole second = byte_code(low[1] + v * step[1]);
        store_pairs(to + 2 * x, (Bits)(first | second << 8));
    }
}

// Sums of the bytes at even and at odd places.
PARADIZE_INLINE void add_bytes(const Bytes &counters, std::uint32_t &even, std::uint32_t &odd) {
    std::uint64_t words[sizeof(Bytes) / 8];
    std::memcpy(words, &counters, sizeof(words));
    constexpr std::uint64_t low = 0x00ff00ff00ff00ffU;
    constexpr std::uint64_t ones = 0x0001000100010001U; // the product's highest part is the sum of four
    for (const std::uint64_t word : words) {
        even += static_cast<std::uint32_t>(((word & low) * ones) >> 48);
        odd += static_cast<std::uint32_t>((((word >> 8) & low) * ones) >> 48);
    }
}

static void count_levels(const std::uint8_t *fine, std::size_t n, std::uint32_t *counts) {
    constexpr std::size_t wide = sizeof(Bytes);
    std::size_t x = 0;
    while (x + wide <= 2 * n) {
        Bytes found[levels] = {};
        for (int step = 0; step < 255 && x + wide <= 2 * n; ++step, x += wide) {
            Bytes v;
            std::memcpy(&v, fine + x, wide);
            for (std::size_t k = 1; k < levels; ++k) {
                count_from(found[k], v, static_cast<std::uint8_t>(level_step * k));
            }
        }
        for (std::size_t k = 1; k < levels; ++k) {
            add_bytes(found[k], counts[k], counts[levels + k]);
        }
    }
    for (; x < 2 * n; ++x) {
        for (std::size_t k = 1; k <= fine[x] / level_step; ++k) {
            ++counts[levels * (x & 1) + k];
        }
    }
    counts[0] += static_cast<std::uint32_t>(n);
    counts[levels] += static_cast<std::uint32_t>(n);
}

// One channel: the shifted codes, and one more for the first `more` whose shifted-out byte is of
// the highest level.
PARADIZE_INLINE Whole shifted(const Bits &unorm, const Bits &low, std::int32_t shift, const Whole &keep,
                              std::uint32_t &more) {
    const Whole d = (Whole)unorm - 128;
    const Whole moved = 255 * d + (((Whole)low + d) & 255) + shift;
    Whole code = moved >> 8;
    if (more > 0) {
        Whole bump = ((moved & 255) >= static_cast<std::int32_t>(256 - level_step)) & keep;
        std::uint32_t found = count(bump);
        if (found > more) {
            std::uint32_t left = more;
            for (std::size_t i = 0; i < lanes; ++i) {
                if (bump[i] != 0) {
                    bump[i] = left > 0 ? -1 : 0;
                    left -= left > 0 ? 1 : 0;
                }
            }
            found = more;
        }
        more -= found;
        code -= bump;
    }
    return code;
}

static void shifted_codes(const std::uint8_t *rgb, const std::uint8_t *rest, std::size_t n,
                          const std::int32_t *shift, std::uint32_t *more, std::uint8_t *to) {
    for (std::size_t x = 0; x < n; x += lanes) {
        const Whole keep = first_lanes(n - x);
        const Bits words = load_rgb(rgb + 3 * x);
        const Bits low = load_pairs(rest + 2 * x);
        const Whole u = shifted(words & 255U, low & 255U, shift[0], keep, more[0]);
        const Whole v = shifted((words >> 8) & 255U, low >> 8, shift[1], keep, more[1]);
        store_pairs(to + 2 * x, ((Bits)u & 255U) | ((Bits)v << 8));
    }
}

const Kernels *kernels() {
    static constexpr Kernels table{&copy,          &along,        &row,         &from_slopes,
                                   &apply_levels,  &height_codes, &gloss_codes, &count_levels,
                                   &shifted_codes, &stream,       &fence};
    return &table;
}

} // namespace paradize::normals::PARADIZE_WIDTH
