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
typedef std::int32_t IntLanes __attribute__((vector_size(4 * PARADIZE_LANES)));
typedef std::uint32_t Bits __attribute__((vector_size(4 * PARADIZE_LANES)));

PARADIZE_INLINE Lanes load(const float *from) {
    return *reinterpret_cast<const LanesAnywhere *>(from);
}

PARADIZE_INLINE void store(float *to, const Lanes &v) {
    *reinterpret_cast<LanesAnywhere *>(to) = v;
}

// -1 in the first n lanes.
PARADIZE_INLINE IntLanes first_lanes(std::size_t n) {
    IntLanes index;
    for (std::size_t i = 0; i < lanes; ++i) {
        index[i] = static_cast<std::int32_t>(i);
    }
    return index < static_cast<std::int32_t>(n < lanes ? n : lanes);
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
