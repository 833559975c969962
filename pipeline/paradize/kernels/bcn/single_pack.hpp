// The bytes of one channel of a block, from its ends.
#pragma once

#include "bcn/single.hpp"

namespace paradize::bcn::PARADIZE_WIDTH {

struct ValueEnds {
    Lanes low;
    Lanes high;
};

// Calls take(v, sum) for every texel v; the last three bits of `sum`, a float, are its place from the low
// end.
template <typename Take>
PARADIZE_INLINE void each_place(const ValueBlocks &blocks, const ValueEnds &ends, Take &&take) {
    const Lanes scale = 7.0F / (ends.high - ends.low);
    const Lanes offset = (ends.low - blocks.mean) * scale;
    for (std::size_t i = 0; i < texels; ++i) {
        take(i, clamped(blocks.v[i] * scale - offset, 7.0F) + to_whole);
    }
}

// Places from the low end -> the indices that are stored: 0 is the high end, 1 the low one, then downwards.
PARADIZE_INLINE IntLanes eight_stored(const IntLanes &bits) {
    constexpr int every_third = 0x249249;
    const IntLanes down = ~bits; // places from the high end
    const IntLanes b0 = down & every_third, b1 = down >> 1 & every_third, b2 = down >> 2 & every_third;
    const IntLanes n1 = b1 ^ b0, n2 = b2 ^ (b1 & b0);   // one more, where seven becomes zero
    const IntLanes n0 = b0 ^ ((n1 | n2) & every_third); // zero and one change places
    return n0 | n1 << 1 | n2 << 2;
}

// The two words of blocks, from their ends.
PARADIZE_INLINE void pack_eight(const ValueBlocks &blocks, const ValueEnds &ends, IntLanes (&words)[2]) {
    typedef std::uint32_t Bits __attribute__((vector_size(4 * PARADIZE_LANES)));
    Bits bits[2] = {}; // of texels 0 to 7, and 8 to 15
    each_place(blocks, ends, [&](std::size_t i, const Lanes &sum) {
        bits[i / 8] += (Bits)sum << (3 * static_cast<int>(i % 8));
    });
    std::uint32_t beside = 0; // of to_whole's own bits
    for (int i = 0; i < 8; ++i) {
        beside += 0x4B400000U << (3 * i);
    }
    const IntLanes first = eight_stored((IntLanes)(bits[0] - beside));
    const IntLanes second = eight_stored((IntLanes)(bits[1] - beside));
    words[0] = (to_int(ends.high) & 255) | (to_int(ends.low) & 255) << 8 | first << 16;
    words[1] = first >> 16 | second << 8;
}

// Place of a texel -> the index that is stored: 0 and 1 are the ends, then from the first to the second.
template <int Steps>
PARADIZE_INLINE IntLanes stored(const IntLanes &from_first) {
    const IntLanes next = from_first + 1;
    return from_first == 0 ? IntLanes{} : (from_first == Steps ? IntLanes{} + 1 : next);
}

struct ValueWords {
    IntLanes first;
    IntLanes second;
};

PARADIZE_INLINE void add_index(const IntLanes &index, int i, ValueWords &words) {
    if (i < 5) {
        words.first |= index << (16 + 3 * i);
    } else if (i == 5) {
        words.first |= index << 31;
        words.second |= index >> 1;
    } else {
        words.second |= index << (3 * i - 16);
    }
}

// The two words of every block.
PARADIZE_STEP void pack_single(const ValueBlocks &blocks, CodeRange range, const ValueFit &fit,
                               IntLanes &first, IntLanes &second) {
    IntLanes words[2];
    pack_eight(blocks, {fit.low, fit.six ? fit.low + 1.0F : fit.high}, words);
    if (any(fit.six)) {
        ValueWords other = {};
        const Lanes width = fit.high - fit.low;
        const auto wide = width > Lanes{};
        const Lanes scale = wide ? 5.0F / (wide ? width : splat(1.0F)) : Lanes{};
        const Lanes start = fit.low - blocks.mean;
        const Lanes offset = start * scale;
        const Lanes bottom = range.bottom - blocks.mean;
        const Lanes top = range.top - blocks.mean;
        for (std::size_t i = 0; i < texels; ++i) { // places from the low end, which is stored first
            const Lanes v = blocks.v[i];
            const Lanes q = clamped(v * scale - offset, 5.0F);
            const Lanes off = v - (start + nearest(q) * (width * (1.0F / 5.0F)));
            const Lanes to_bottom = (v - bottom) * (v - bottom);
            const Lanes to_top = (top - v) * (top - v);
            const auto end = off * off > least(to_bottom, to_top);
            const IntLanes index =
                end ? (to_bottom <= to_top ? IntLanes{} + 6 : IntLanes{} + 7) : stored<5>(nearest_bits(q, 3));
            add_index(index, static_cast<int>(i), other);
        }
        other.first |= (to_int(fit.low) & 255) | (to_int(fit.high) & 255) << 8;
        words[0] = fit.six ? other.first : words[0];
        words[1] = fit.six ? other.second : words[1];
    }
    first = words[0];
    second = words[1];
}

} // namespace paradize::bcn::PARADIZE_WIDTH
