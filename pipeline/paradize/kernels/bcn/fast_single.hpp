// The fast tier of one channel of a block: the outermost texels as ends, then least squares once. Six values
// are tried only where a block touches the ends of the range and little lies between.
#pragma once

#include "bcn/single_fit.hpp"

namespace paradize::bcn::PARADIZE_WIDTH {

PARADIZE_INLINE ValuePlaces places_between(const ValueBlocks &blocks, const ValueEnds &ends) {
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

// Where six values serve a block better than eight between `ends`, `words` become theirs.
PARADIZE_STEP void try_six(const ValueBlocks &blocks, CodeRange range, const ValueEnds &ends,
                           IntLanes (&words)[2]) {
    Lanes low, high;
    const IntLanes narrow = outer_six(blocks, range, low, high);
    if (!any(narrow)) {
        return;
    }
    ValuePlaces places;
    place<7>(blocks, ends.low, ends.high, range, places);
    const IntLanes asked = touching(blocks, range) & narrow & (places.error > 1e-3F);
    ValueFit best = {ends.low, ends.high, places.error, places.worst, splat(1e30F), {}};
    settle<5>(blocks, range, 0, low, high, asked, best);
    if (any(best.six)) {
        pack_single(blocks, range, best, words[0], words[1]);
    }
}

// blocks[n].v: codes within the range -> the two words of every block. `count` of them, up to N, step by
// step: one's arithmetic fills the time that another's takes.
template <std::size_t N>
PARADIZE_STEP void fast_single(ValueBlocks (&blocks)[N], std::size_t count, CodeRange range,
                               IntLanes (&words)[N][2]) {
    ValueEnds ends[N];
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
        if (any(touching(blocks[n], range))) {
            try_six(blocks[n], range, ends[n], words[n]);
        }
    }
}

} // namespace paradize::bcn::PARADIZE_WIDTH
