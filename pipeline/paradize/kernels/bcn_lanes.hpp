// The sixteen texels of a block, side by side: loops over them become vector instructions, and their sums are
// taken in one fixed order, so every CPU gives the same bits.
#pragma once

#include <array>
#include <cstddef>

#if defined(__GNUC__)
#define PARADIZE_INLINE inline __attribute__((always_inline))
#else
#define PARADIZE_INLINE inline
#endif

namespace paradize::bcn {

inline constexpr std::size_t texels = 16;
using Lanes = std::array<float, texels>;

PARADIZE_INLINE float sum(const Lanes &a) {
    std::array<float, 8> b;
    for (std::size_t i = 0; i < 8; ++i) {
        b[i] = a[i] + a[i + 8];
    }
    return ((b[0] + b[4]) + (b[2] + b[6])) + ((b[1] + b[5]) + (b[3] + b[7]));
}

PARADIZE_INLINE float smallest(const Lanes &a) {
    std::array<float, 8> b;
    for (std::size_t i = 0; i < 8; ++i) {
        b[i] = a[i] < a[i + 8] ? a[i] : a[i + 8];
    }
    for (std::size_t i = 1; i < 8; ++i) {
        b[0] = b[i] < b[0] ? b[i] : b[0];
    }
    return b[0];
}

PARADIZE_INLINE float largest(const Lanes &a) {
    std::array<float, 8> b;
    for (std::size_t i = 0; i < 8; ++i) {
        b[i] = a[i] > a[i + 8] ? a[i] : a[i + 8];
    }
    for (std::size_t i = 1; i < 8; ++i) {
        b[0] = b[i] > b[0] ? b[i] : b[0];
    }
    return b[0];
}

// v rounded to the nearest integer within [0, top], for v > -1e9.
PARADIZE_INLINE float rounded(float v, float top) {
    const float clamped = v < 0.0F ? 0.0F : (v > top ? top : v);
    return static_cast<float>(static_cast<int>(clamped + 0.5F));
}

} // namespace paradize::bcn
