// 16-bit integers side by side: two to each lane of `IntLanes`. All operations are exact, so every
// instruction set gives the same bits.
#pragma once

#include "bcn/lanes.hpp"

namespace paradize::bcn::PARADIZE_WIDTH {

typedef std::int16_t Halves __attribute__((vector_size(4 * PARADIZE_LANES)));
typedef std::uint16_t Unsigned __attribute__((vector_size(4 * PARADIZE_LANES)));

// One instruction of each set, or its meaning spelled out.
#if PARADIZE_LANES == 16
#define PARADIZE_NATIVE(name, a, b) _mm512_##name((__m512i)(a), (__m512i)(b))
#elif PARADIZE_LANES == 8
#define PARADIZE_NATIVE(name, a, b) _mm256_##name((__m256i)(a), (__m256i)(b))
#elif defined(__SSE2__)
#define PARADIZE_NATIVE(name, a, b) _mm_##name((__m128i)(a), (__m128i)(b))
#endif

// Of each lane: the product of the low halves and that of the high ones, added.
PARADIZE_INLINE IntLanes dot(const IntLanes &a, const IntLanes &b) {
#ifdef PARADIZE_NATIVE
    return (IntLanes)PARADIZE_NATIVE(madd_epi16, a, b);
#else
    return (a << 16 >> 16) * (b << 16 >> 16) + (a >> 16) * (b >> 16);
#endif
}

// Halves of a * b, their low 16 bits.
PARADIZE_INLINE IntLanes product(const IntLanes &a, const IntLanes &b) {
    return (IntLanes)((Halves)a * (Halves)b);
}

// In each group of four lanes: a's as the first four halves, b's as the last, kept within 16 bits.
PARADIZE_INLINE Halves packed(const IntLanes &a, const IntLanes &b) {
#ifdef PARADIZE_NATIVE
    return (Halves)PARADIZE_NATIVE(packs_epi32, a, b);
#else
    Halves out;
    for (std::size_t i = 0; i < lanes; ++i) {
        const auto within = [](std::int32_t v) {
            return static_cast<std::int16_t>(v < -32768 ? -32768 : v > 32767 ? 32767 : v);
        };
        out[i / 4 * 8 + i % 4] = within(a[i]);
        out[i / 4 * 8 + i % 4 + 4] = within(b[i]);
    }
    return out;
#endif
}

// The reverse, each twice: from the first four halves of each group, or from the last.
PARADIZE_INLINE IntLanes first_twice(const Halves &v) {
#ifdef PARADIZE_NATIVE
    return (IntLanes)PARADIZE_NATIVE(unpacklo_epi16, v, v);
#else
    IntLanes out;
    for (std::size_t i = 0; i < lanes; ++i) {
        out[i] = (v[i / 4 * 8 + i % 4] & 0xFFFF) * 0x10001;
    }
    return out;
#endif
}

PARADIZE_INLINE IntLanes last_twice(const Halves &v) {
#ifdef PARADIZE_NATIVE
    return (IntLanes)PARADIZE_NATIVE(unpackhi_epi16, v, v);
#else
    IntLanes out;
    for (std::size_t i = 0; i < lanes; ++i) {
        out[i] = (v[i / 4 * 8 + i % 4 + 4] & 0xFFFF) * 0x10001;
    }
    return out;
#endif
}

// Upper 16 bits of the products of unsigned halves.
PARADIZE_INLINE Halves upper_product(const Halves &a, const Halves &b) {
#ifdef PARADIZE_NATIVE
    return (Halves)PARADIZE_NATIVE(mulhi_epu16, a, b);
#else
    Halves out;
    for (std::size_t i = 0; i < 2 * lanes; ++i) {
        out[i] = static_cast<std::int16_t>((a[i] & 0xFFFFU) * (b[i] & 0xFFFFU) >> 16);
    }
    return out;
#endif
}

// Compilers make one instruction of each of these.
PARADIZE_INLINE Halves least(const Halves &a, const Halves &b) {
    return a < b ? a : b;
}

PARADIZE_INLINE Halves most(const Halves &a, const Halves &b) {
    return a > b ? a : b;
}

// Byte by byte, without a sign.
typedef std::uint8_t Bytes __attribute__((vector_size(4 * PARADIZE_LANES)));

PARADIZE_INLINE IntLanes least_bytes(const IntLanes &a, const IntLanes &b) {
    return (IntLanes)((Bytes)a < (Bytes)b ? (Bytes)a : (Bytes)b);
}

PARADIZE_INLINE IntLanes most_bytes(const IntLanes &a, const IntLanes &b) {
    return (IntLanes)((Bytes)a > (Bytes)b ? (Bytes)a : (Bytes)b);
}

#undef PARADIZE_NATIVE

} // namespace paradize::bcn::PARADIZE_WIDTH
