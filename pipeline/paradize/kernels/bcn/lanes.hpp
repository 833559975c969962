// Several blocks side by side: lane i of every vector belongs to block i. Each translation unit that includes
// this compiles it for another instruction set, under another name (PARADIZE_WIDTH) and with as many lanes as
// that set has (PARADIZE_LANES). A block's result depends on its own lane only, the operations are IEEE's and
// nothing is fused: all give the same bits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

#include "simd/lanes.hpp"

// Long steps that many callers share: one copy of each, so that they compile quickly and stay in the cache.
#define PARADIZE_STEP static __attribute__((noinline))

namespace paradize::bcn::PARADIZE_WIDTH {

constexpr std::size_t lanes = PARADIZE_LANES; // blocks at once
constexpr std::size_t texels = 16;            // of a block
using side_by_side::PARADIZE_WIDTH::Lanes;
using side_by_side::PARADIZE_WIDTH::root;
typedef std::int32_t IntLanes __attribute__((vector_size(4 * PARADIZE_LANES)));

PARADIZE_INLINE Lanes splat(float v) {
    return Lanes{} + v;
}

// a < b ? a : b and a > b ? a : b, which the compiler does not turn into one instruction on its own.
#if PARADIZE_LANES == 16
PARADIZE_INLINE Lanes least(const Lanes &a, const Lanes &b) {
    return (Lanes)_mm512_maskz_min_ps(0xFFFF, (__m512)a, (__m512)b);
}

PARADIZE_INLINE Lanes most(const Lanes &a, const Lanes &b) {
    return (Lanes)_mm512_maskz_max_ps(0xFFFF, (__m512)a, (__m512)b);
}
#elif PARADIZE_LANES == 8
PARADIZE_INLINE Lanes least(const Lanes &a, const Lanes &b) {
    return (Lanes)_mm256_min_ps((__m256)a, (__m256)b);
}

PARADIZE_INLINE Lanes most(const Lanes &a, const Lanes &b) {
    return (Lanes)_mm256_max_ps((__m256)a, (__m256)b);
}
#elif defined(__SSE2__)
PARADIZE_INLINE Lanes least(const Lanes &a, const Lanes &b) {
    return (Lanes)_mm_min_ps((__m128)a, (__m128)b);
}

PARADIZE_INLINE Lanes most(const Lanes &a, const Lanes &b) {
    return (Lanes)_mm_max_ps((__m128)a, (__m128)b);
}
#else
PARADIZE_INLINE Lanes least(const Lanes &a, const Lanes &b) {
    return a < b ? a : b;
}

PARADIZE_INLINE Lanes most(const Lanes &a, const Lanes &b) {
    return a > b ? a : b;
}
#endif

PARADIZE_INLINE Lanes absolute(const Lanes &v) {
    return most(v, -v);
}

// Within [0, top]; what is not a number becomes 0.
PARADIZE_INLINE Lanes clamped(const Lanes &v, float top) {
    return least(most(v, Lanes{}), splat(top));
}

// The sum's last bits hold v rounded to the nearest integer (ties to even), for v in [0, 2^21].
constexpr float to_whole = 12582912.0F; // 1.5 * 2^23

PARADIZE_INLINE Lanes nearest(const Lanes &v) {
    return (v + to_whole) - to_whole;
}

// The same as an integer, of the low `bits` bits.
PARADIZE_INLINE IntLanes nearest_bits(const Lanes &v, int bits) {
    const Lanes sum = v + to_whole;
    IntLanes out;
    std::memcpy(&out, &sum, sizeof(out));
    return out & ((1 << bits) - 1);
}

PARADIZE_INLINE Lanes floored(const Lanes &v) {
    const Lanes whole = nearest(v);
    return whole > v ? whole - 1.0F : whole;
}

PARADIZE_INLINE IntLanes to_int(const Lanes &v) {
    return __builtin_convertvector(v, IntLanes);
}

PARADIZE_INLINE Lanes to_float(const IntLanes &v) {
    return __builtin_convertvector(v, Lanes);
}

// Whether any lane of a comparison's result holds.
PARADIZE_INLINE bool any(const IntLanes &mask) {
    std::int64_t halves[sizeof(IntLanes) / 8];
    std::memcpy(halves, &mask, sizeof(mask));
    std::int64_t all = 0;
    for (const std::int64_t half : halves) {
        all |= half;
    }
    return all != 0;
}

template <typename Vector, std::size_t... I>
PARADIZE_INLINE Vector evens(const Vector &a, const Vector &b, std::index_sequence<I...>) {
    return __builtin_shufflevector(a, b, (2 * I)...);
}

template <typename Vector, std::size_t... I>
PARADIZE_INLINE Vector odds(const Vector &a, const Vector &b, std::index_sequence<I...>) {
    return __builtin_shufflevector(a, b, (2 * I + 1)...);
}

template <std::size_t From, typename Vector, std::size_t... I>
PARADIZE_INLINE Vector zipped(const Vector &a, const Vector &b, std::index_sequence<I...>) {
    return __builtin_shufflevector(a, b, (From + I / 2 + (I % 2) * lanes)...);
}

using Each = std::make_index_sequence<lanes>;

// in: 4 * lanes values in a row; out[x]: every fourth from the x-th.
template <typename Vector>
PARADIZE_INLINE void every_fourth(const Vector (&in)[4], Vector (&out)[4]) {
    const Vector e0 = evens(in[0], in[1], Each{});
    const Vector e1 = evens(in[2], in[3], Each{});
    const Vector o0 = odds(in[0], in[1], Each{});
    const Vector o1 = odds(in[2], in[3], Each{});
    out[0] = evens(e0, e1, Each{});
    out[1] = evens(o0, o1, Each{});
    out[2] = odds(e0, e1, Each{});
    out[3] = odds(o0, o1, Each{});
}

// Element From + I / 2 of each group of four, of a and b in turns, or pairs of elements in turns.
template <std::size_t From, std::size_t Size, typename Vector, std::size_t... I>
PARADIZE_INLINE Vector merged(const Vector &a, const Vector &b, std::index_sequence<I...>) {
    return __builtin_shufflevector(
        a, b, (I / 4 * 4 + From + (I % 4) / (2 * Size) * Size + I % Size + I / Size % 2 * lanes)...);
}

// in: 4 * lanes values in a row; out[x]: every fourth from the x-th, in the order of `in_order`'s argument,
// which takes half the time.
template <typename Vector>
PARADIZE_INLINE void every_fourth_grouped(const Vector (&in)[4], Vector (&out)[4]) {
    const Vector a = merged<0, 1>(in[0], in[1], Each{});
    const Vector b = merged<0, 1>(in[2], in[3], Each{});
    const Vector c = merged<2, 1>(in[0], in[1], Each{});
    const Vector d = merged<2, 1>(in[2], in[3], Each{});
    out[0] = merged<0, 2>(a, b, Each{});
    out[1] = merged<2, 2>(a, b, Each{});
    out[2] = merged<0, 2>(c, d, Each{});
    out[3] = merged<2, 2>(c, d, Each{});
}

template <typename Vector, std::size_t... I>
PARADIZE_INLINE Vector in_order(const Vector &v, std::index_sequence<I...>) {
    return __builtin_shufflevector(v, v, (I % (lanes / 4) * 4 + I / (lanes / 4))...);
}

// Stores for every block its words one after another.
PARADIZE_INLINE void store_blocks(const IntLanes &first, const IntLanes &second, std::uint8_t *out) {
    const IntLanes low = zipped<0>(first, second, Each{});
    const IntLanes high = zipped<lanes / 2>(first, second, Each{});
    std::memcpy(out, &low, sizeof(low));
    std::memcpy(out + sizeof(low), &high, sizeof(high));
}

PARADIZE_INLINE void store_blocks(const IntLanes (&words)[4], std::uint8_t *out) {
    const IntLanes even0 = zipped<0>(words[0], words[2], Each{});
    const IntLanes even1 = zipped<lanes / 2>(words[0], words[2], Each{});
    const IntLanes odd0 = zipped<0>(words[1], words[3], Each{});
    const IntLanes odd1 = zipped<lanes / 2>(words[1], words[3], Each{});
    store_blocks(even0, odd0, out);
    store_blocks(even1, odd1, out + 2 * sizeof(IntLanes));
}

} // namespace paradize::bcn::PARADIZE_WIDTH
