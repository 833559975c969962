// The sixteen texels of a block, side by side, as one vector of the compiler's: each translation unit that
// includes this compiles it for another instruction set, under another name (PARADIZE_WIDTH), and all give
// the same bits: the operations are IEEE's, nothing is fused, and sums are taken in one fixed order.
#pragma once

#include <cstddef>
#include <cstdint>

#define PARADIZE_INLINE static inline __attribute__((always_inline))

namespace paradize::bcn::PARADIZE_WIDTH {

constexpr std::size_t texels = 16;
typedef float Lanes __attribute__((vector_size(64)));
typedef float Lanes8 __attribute__((vector_size(32)));
typedef float Lanes4 __attribute__((vector_size(16)));
typedef std::int32_t Whole __attribute__((vector_size(64)));

PARADIZE_INLINE float sum(const Lanes &a) {
    const Lanes8 b = __builtin_shufflevector(a, a, 0, 1, 2, 3, 4, 5, 6, 7) +
                     __builtin_shufflevector(a, a, 8, 9, 10, 11, 12, 13, 14, 15);
    const Lanes4 c = __builtin_shufflevector(b, b, 0, 1, 2, 3) + __builtin_shufflevector(b, b, 4, 5, 6, 7);
    return (c[0] + c[2]) + (c[1] + c[3]);
}

PARADIZE_INLINE float smallest(const Lanes &a) {
    const Lanes8 low = __builtin_shufflevector(a, a, 0, 1, 2, 3, 4, 5, 6, 7);
    const Lanes8 high = __builtin_shufflevector(a, a, 8, 9, 10, 11, 12, 13, 14, 15);
    const Lanes8 b = low < high ? low : high;
    const Lanes4 left = __builtin_shufflevector(b, b, 0, 1, 2, 3);
    const Lanes4 right = __builtin_shufflevector(b, b, 4, 5, 6, 7);
    const Lanes4 c = left < right ? left : right;
    const float d = c[0] < c[2] ? c[0] : c[2];
    const float e = c[1] < c[3] ? c[1] : c[3];
    return d < e ? d : e;
}

PARADIZE_INLINE float largest(const Lanes &a) {
    return -smallest(-a);
}

// v rounded to the nearest integer within [0, top], for v > -1e9.
PARADIZE_INLINE float rounded(float v, float top) {
    const float clamped = v < 0.0F ? 0.0F : (v > top ? top : v);
    return static_cast<float>(static_cast<int>(clamped + 0.5F));
}

PARADIZE_INLINE void rounded(const Lanes &v, float top, Lanes &out) {
    const Lanes zero = {};
    const Lanes ceiling = zero + top;
    const Lanes above = v < zero ? zero : v;
    const Lanes clamped = above > ceiling ? ceiling : above;
    out = __builtin_convertvector(__builtin_convertvector(clamped + 0.5F, Whole), Lanes);
}

} // namespace paradize::bcn::PARADIZE_WIDTH
