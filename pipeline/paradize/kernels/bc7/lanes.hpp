// As many blocks side by side as the instruction set has lanes. Each translation unit that includes this
// compiles it for another instruction set, under another name (PARADIZE_WIDTH) and with another number of
// lanes (PARADIZE_LANES). A lane never looks at another and the operations are IEEE's, none fused, so a block
// gets the same bits whatever the width.
#pragma once

#include <cstddef>
#include <cstdint>

#include "bc7/tables.hpp"

#define PARADIZE_INLINE static inline __attribute__((always_inline))
// For what a dozen places share: inlined in each it doubled the time to compile.
#define PARADIZE_CALLED static __attribute__((noinline))

namespace paradize::bc7::PARADIZE_WIDTH {

constexpr int lanes = PARADIZE_LANES;
typedef float Lanes __attribute__((vector_size(4 * PARADIZE_LANES)));
typedef std::int32_t IntLanes __attribute__((vector_size(4 * PARADIZE_LANES)));

PARADIZE_INLINE Lanes all(float value) {
    return Lanes{} + value;
}

PARADIZE_INLINE Lanes smaller(const Lanes &a, const Lanes &b) {
    return a < b ? a : b;
}

PARADIZE_INLINE Lanes larger(const Lanes &a, const Lanes &b) {
    return a > b ? a : b;
}

PARADIZE_INLINE Lanes clamped(const Lanes &a, float top) {
    return smaller(larger(a, Lanes{}), all(top));
}

// The nearest integer, for magnitudes below 2^22; halves go to the even one.
PARADIZE_INLINE Lanes nearest(const Lanes &a) {
    constexpr float shift = 12582912.0F; // 1.5 * 2^23: what is added to it loses its fraction
    return (a + shift) - shift;
}

// The integer below, for 0 <= a < 2^22.
PARADIZE_INLINE Lanes below(const Lanes &a) {
    return __builtin_convertvector(__builtin_convertvector(a, IntLanes), Lanes);
}

PARADIZE_INLINE bool any(const IntLanes &mask) {
    std::int32_t bits = 0;
    for (int lane = 0; lane < lanes; ++lane) {
        bits |= mask[lane];
    }
    return bits != 0;
}

// The texels of as many blocks as there are lanes: red, green, blue, alpha, 0..255.
struct Block {
    Lanes v[4][texels];
};

} // namespace paradize::bc7::PARADIZE_WIDTH
