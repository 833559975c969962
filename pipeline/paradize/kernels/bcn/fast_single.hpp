// The fast tier of one channel of a block: the outermost texels as ends, then least squares once.
#pragma once

#include "bcn/single_fit.hpp"

namespace paradize::bcn::PARADIZE_WIDTH {

struct FastEnds {
    Lanes low;
    Lanes high;
};

// Calls take(v, sum) for every texel v; the last three bits of `sum`, a float, are its place from the low
// end.
template <typename Take>
PARADIZE_INLINE void each_place(const ValueBlocks &blocks, const FastEnds &ends, Take &&take) {
    const Lanes scale = 7.0F / (ends.high - ends.low);
    const Lanes offset = (ends.low - blocks.mean) * scale;
    for (std::size_t i = 0; i < texels; ++i) {
        take(i, clamped(blocks.v[i] * scale - offset, 7.0F) + to_whole);
    }
}

PARADIZE_INLINE ValuePlaces places_between(const ValueBlocks &blocks, const FastEnds &ends) {
    ValuePlaces places = {};
    each_place(blocks, ends, [&](std::size_t i, const Lanes &sum) {
        const Lanes q = sum - to_whole;
        places.q += q;
        places.qq += q * q;
        places.qv += q * blocks.v[i];
    });
    places.count = splat(16.0F);
    return places;
}

// Places from the low end -> the indices that are stored: 0 is the high end, 1 the low one, then downwards.
PARADIZE_INLINE Whole eight_stored(const Whole &bits) {
    constexpr int every_third = 0x249249;
    const Whole down = ~bits; // places from the high end
    const Whole b0 = down & every_third, b1 = down >> 1 & every_third, b2 = down >> 2 & every_third;
    const Whole n1 = b1 ^ b0, n2 = b2 ^ (b1 & b0);   // one more, where seven becomes zero
    const Whole n0 = b0 ^ ((n1 | n2) & every_third); // zero and one change places
    return n0 | n1 << 1 | n2 << 2;
}

// The two words of blocks, from their ends.
PARADIZE_INLINE void pack_eight(const ValueBlocks &blocks, const FastEnds &ends, Whole (&words)[2]) {
    typedef std::uint32_t Bits __attribute__((vector_size(4 * PARADIZE_LANES)));
    Bits bits[2] = {}; // of texels 0 to 7, and 8 to 15
    each_place(blocks, ends, [&](std::size_t i, const Lanes &sum) {
        bits[i / 8] += (Bits)sum << (3 * static_cast<int>(i % 8));
    });
    std::uint32_t beside = 0; // of to_whole's own bits
    for (int i = 0; i < 8; ++i) {
        beside += 0x4B400000U << (3 * i);
    }
    const Whole first = eight_stored((Whole)(bits[0] - beside));
    const Whole second = eight_stored((Whole)(bits[1] - beside));
    words[0] = (to_int(ends.high) & 255) | (to_int(ends.low) & 255) << 8 | first << 16;
    words[1] = first >> 16 | second << 8;
}

// blocks[n].v: codes within the range -> the two words of every block. `count` of them, up to N, step by
// step: one's arithmetic fills the time that another's takes.
template <std::size_t N>
PARADIZE_STEP void fast_single(ValueBlocks (&blocks)[N], std::size_t count, CodeRange range,
                               Whole (&words)[N][2]) {
    FastEnds ends[N];
    ValuePlaces places[N];
    for (std::size_t n = 0; n < count; ++n) {
        centre(blocks[n]);
        outer_eight(blocks[n], range, ends[n].low, ends[n].high);
        places[n] = places_between(blocks[n], ends[n]);
    }
    for (std::size_t n = 0; n < count; ++n) {
        refit<7, 2>(blocks[n], places[n], range, ends[n].low, ends[n].high);
    }
    for (std::size_t n = 0; n < count; ++n) {
        pack_eight(blocks[n], ends[n], words[n]);
    }
}

} // namespace paradize::bcn::PARADIZE_WIDTH
