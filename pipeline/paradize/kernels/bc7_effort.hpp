// How much is tried for a block, and what was chosen for it.
#pragma once

#include <array>
#include <cstdint>

#include "bc7_tables.hpp"

namespace paradize::bc7 {

// Passes: refinements of the ends after the first. The others count the partitions, 0..16, whose ends are
// fitted, of the mode named; the best by bc7_rank.hpp's estimate come first.
struct Effort {
    int passes6;
    int passes;
    int mode1;
    int mode3;
    int mode0;
    int mode2;
    int mode7;
    int rotations;        // of modes 4 and 5, 0..4, for blocks with alpha
    int opaque_rotations; // the same for opaque blocks
    float enough;         // a block with this squared error (0..255, summed) or less is not looked at again

    // Whether there is more to try than mode 6.
    bool more(bool opaque) const {
        return opaque ? mode1 + mode3 + mode0 + mode2 + opaque_rotations > 0 : mode7 + rotations > 0;
    }
};

// Of the qualities fast, balanced, exact.
constexpr std::array<Effort, 3> efforts{{
    {2, 1, 1, 0, 0, 0, 0, 1, 0, 200.0F},
    {2, 1, 2, 1, 0, 0, 1, 1, 0, 30.0F},
    {3, 2, 8, 4, 4, 4, 8, 4, 1, 0.0F},
}};

// One block's choice; codes hold their low bits. Colour and alpha ends [subset][end][channel].
struct Choice {
    int mode;
    int partition;
    int rotation;
    int selector;
    int code[3][2][4];
    int index[texels];
    int second[texels];
};

} // namespace paradize::bc7
