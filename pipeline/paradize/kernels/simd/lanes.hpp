// Floats side by side, as many as the instruction set has that a translation unit is compiled for
// (PARADIZE_LANES), under its name (PARADIZE_WIDTH).
#pragma once

#include <cstddef>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#define PARADIZE_INLINE static inline __attribute__((always_inline))

namespace paradize::side_by_side::PARADIZE_WIDTH {

constexpr std::size_t lanes = PARADIZE_LANES;
typedef float Lanes __attribute__((vector_size(4 * PARADIZE_LANES)));

// The square root of each, correctly rounded.
PARADIZE_INLINE Lanes root(const Lanes &v) {
#if PARADIZE_LANES == 16
    return (Lanes)_mm512_maskz_sqrt_ps(0xFFFF, (__m512)v);
#elif PARADIZE_LANES == 8
    return (Lanes)_mm256_sqrt_ps((__m256)v);
#elif defined(__SSE2__)
    return (Lanes)_mm_sqrt_ps((__m128)v);
#else
    Lanes out;
    for (std::size_t i = 0; i < lanes; ++i) {
        out[i] = __builtin_sqrtf(v[i]);
    }
    return out;
#endif
}

} // namespace paradize::side_by_side::PARADIZE_WIDTH
