// A few texels side by side as one vector of the compiler's. Each translation unit that includes this
// compiles it for another instruction set under another name (PARADIZE_WIDTH, PARADIZE_LANES); all give the
// same bits: the operations are IEEE's, nothing is fused, and no sum depends on how many texels stand side by
// side.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

#include "simd/lanes.hpp"

namespace paradize::normals::PARADIZE_WIDTH {

constexpr std::size_t lanes = PARADIZE_LANES;
using side_by_side::PARADIZE_WIDTH::Lanes;
using side_by_side::PARADIZE_WIDTH::root;
typedef float LanesAnywhere __attribute__((vector_size(4 * PARADIZE_LANES), aligned(4), may_alias));
typedef std::int32_t Whole __attribute__((vector_size(4 * PARADIZE_LANES)));
typedef std::uint32_t Bits __attribute__((vector_size(4 * PARADIZE_LANES)));

PARADIZE_INLINE Lanes load(const float *from) {
    return *reinterpret_cast<const LanesAnywhere *>(from);
}

PARADIZE_INLINE void store(float *to, const Lanes &v) {
    *reinterpret_cast<LanesAnywhere *>(to) = v;
}

// -1 in the first n lanes.
PARADIZE_INLINE Whole first_lanes(std::size_t n) {
    Whole index;
    for (std::size_t i = 0; i < lanes; ++i) {
        index[i] = static_cast<std::int32_t>(i);
    }
    return index < static_cast<std::int32_t>(n < lanes ? n : lanes);
}

// Bytes side by side.
typedef std::uint8_t Bytes __attribute__((vector_size(4 * PARADIZE_LANES)));

// One more where v >= least.
PARADIZE_INLINE void count_from(Bytes &counters, const Bytes &v, std::uint8_t least) {
#if PARADIZE_LANES == 16
    const __mmask64 found = _mm512_cmpge_epu8_mask((__m512i)v, _mm512_set1_epi8(static_cast<char>(least)));
    counters = (Bytes)_mm512_mask_sub_epi8((__m512i)counters, found, (__m512i)counters, _mm512_set1_epi8(-1));
#else
    counters -= (Bytes)(v >= least);
#endif
}

// How many lanes are -1; the others are 0.
PARADIZE_INLINE std::uint32_t count(const Whole &mask) {
#if PARADIZE_LANES == 16
    return static_cast<std::uint32_t>(__builtin_popcount(_mm512_movepi32_mask((__m512i)mask)));
#elif PARADIZE_LANES == 8
    return static_cast<std::uint32_t>(
        __builtin_popcount(static_cast<unsigned>(_mm256_movemask_ps((__m256)mask))));
#else
    std::uint32_t found = 0;
    for (std::size_t i = 0; i < lanes; ++i) {
        found += static_cast<std::uint32_t>(-mask[i]);
    }
    return found;
#endif
}

// Three bytes of each lane (red lowest), 3 * lanes in all; writes up to 16 bytes more.
PARADIZE_INLINE void store_rgb(std::uint8_t *to, const Bits &words) {
#if PARADIZE_LANES == 16
    const __m512i near =
        _mm512_shuffle_epi8((__m512i)words, _mm512_set4_epi32(-1, 0x0e0d0c0a, 0x09080605, 0x04020100));
    const __m512i places = _mm512_setr_epi32(0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14, 3, 7, 11, 15);
    const __m512i packed = _mm512_maskz_permutexvar_epi32(static_cast<__mmask16>(-1), places, near);
    std::memcpy(to, &packed, 64);
#elif PARADIZE_LANES == 8
    const __m256i bytes = _mm256_setr_epi8(0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14, -1, -1, -1, -1, 0, 1, 2, 4,
                                           5, 6, 8, 9, 10, 12, 13, 14, -1, -1, -1, -1);
    const __m256i near = _mm256_shuffle_epi8((__m256i)words, bytes);
    const __m256i packed = _mm256_permutevar8x32_epi32(near, _mm256_setr_epi32(0, 1, 2, 4, 5, 6, 3, 7));
    std::memcpy(to, &packed, 32);
#else
    for (std::size_t i = 0; i < lanes; ++i) {
        const std::uint32_t word = words[i];
        std::memcpy(to + 3 * i, &word, 4);
    }
#endif
}

// The other way: red lowest; reads up to 16 bytes beyond 3 * lanes. The highest byte is undefined.
PARADIZE_INLINE Bits load_rgb(const std::uint8_t *from) {
#if PARADIZE_LANES == 16
    __m512i packed;
    std::memcpy(&packed, from, 64);
    const __m512i places = _mm512_setr_epi32(0, 1, 2, 2, 3, 4, 5, 5, 6, 7, 8, 8, 9, 10, 11, 11);
    const __m512i near = _mm512_maskz_permutexvar_epi32(static_cast<__mmask16>(-1), places, packed);
    return (Bits)_mm512_shuffle_epi8(near, _mm512_set4_epi32(0x0c0b0a09, 0x09080706, 0x06050403, 0x03020100));
#elif PARADIZE_LANES == 8
    __m256i packed;
    std::memcpy(&packed, from, 32);
    const __m256i near = _mm256_permutevar8x32_epi32(packed, _mm256_setr_epi32(0, 1, 2, 2, 3, 4, 5, 5));
    const __m256i bytes = _mm256_setr_epi8(0, 1, 2, 3, 3, 4, 5, 6, 6, 7, 8, 9, 9, 10, 11, 12, 0, 1, 2, 3, 3,
                                           4, 5, 6, 6, 7, 8, 9, 9, 10, 11, 12);
    return (Bits)_mm256_shuffle_epi8(near, bytes);
#else
    Bits words;
    for (std::size_t i = 0; i < lanes; ++i) {
        std::uint32_t word;
        std::memcpy(&word, from + 3 * i, 4);
        words[i] = word;
    }
    return words;
#endif
}

typedef std::uint16_t Pairs __attribute__((vector_size(2 * PARADIZE_LANES)));

// The two low bytes of each lane.
PARADIZE_INLINE void store_pairs(std::uint8_t *to, const Bits &words) {
    const Pairs pairs = __builtin_convertvector(words, Pairs);
    std::memcpy(to, &pairs, sizeof(pairs));
}

PARADIZE_INLINE Bits load_pairs(const std::uint8_t *from) {
    Pairs pairs;
    std::memcpy(&pairs, from, sizeof(pairs));
    return __builtin_convertvector(pairs, Bits);
}

// One of three vectors of x0 y0 z0 x1 y1 z1 ...
template <int part, std::size_t... i>
PARADIZE_INLINE Lanes braid(const Lanes &x, const Lanes &y, const Lanes &z, std::index_sequence<i...>) {
    constexpr std::size_t n = lanes;
    constexpr std::size_t from = part * n;
    const Lanes xy =
        __builtin_shufflevector(x, y, ((from + i) % 3 == 1 ? n + (from + i) / 3 : (from + i) / 3)...);
    return __builtin_shufflevector(xy, z, ((from + i) % 3 == 2 ? n + (from + i) / 3 : i)...);
}

PARADIZE_INLINE void store_xyz(float *to, const Lanes &x, const Lanes &y, const Lanes &z) {
    constexpr auto all = std::make_index_sequence<lanes>();
    store(to, braid<0>(x, y, z, all));
    store(to + lanes, braid<1>(x, y, z, all));
    store(to + 2 * lanes, braid<2>(x, y, z, all));
}

// Past the caches: what nobody reads again soon.
static void stream(std::uint8_t *to, const std::uint8_t *from, std::size_t bytes) {
#if defined(__SSE2__)
    constexpr std::size_t step = 64;
    const std::size_t head = (step - reinterpret_cast<std::uintptr_t>(to) % step) % step;
    if (head >= bytes) {
        std::memcpy(to, from, bytes);
        return;
    }
    std::memcpy(to, from, head);
    std::size_t at = head;
    for (; at + step <= bytes; at += step) {
#if PARADIZE_LANES == 16
        _mm512_stream_si512(reinterpret_cast<__m512i *>(to + at), _mm512_loadu_si512(from + at));
#else
        for (std::size_t part = 0; part < step; part += 16) {
            _mm_stream_si128(reinterpret_cast<__m128i *>(to + at + part),
                             _mm_loadu_si128(reinterpret_cast<const __m128i *>(from + at + part)));
        }
#endif
    }
    std::memcpy(to + at, from + at, bytes - at);
#else
    std::memcpy(to, from, bytes);
#endif
}

static void fence() {
#if defined(__SSE2__)
    _mm_sfence();
#endif
}

} // namespace paradize::normals::PARADIZE_WIDTH
