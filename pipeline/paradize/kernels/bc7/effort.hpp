// How much is tried for a block, and what is kept while it is.
#pragma once

#include <array>
#include <cstdint>

#include "bc7/encode.hpp"
#include "bc7/tables.hpp"

namespace paradize::bc7 {

constexpr int most_kept = 16;

// Passes: refinements of the ends after the first. A mode's number: how many partitions, 0..most_kept, are
// fitted, the best by bc7/rank.hpp's estimate first. A trial is left out where the estimate times `doubt`
// reaches what the block already has, and a block whose squared error (0..255, summed) is `enough` or less is
// not looked at again.
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
    float enough;
    float enough_for_three; // the same for partitions of three subsets
    float doubt;
};

// Of the qualities fast, balanced, exact: measured in tests/bench/topics/bc7.py.
constexpr std::array<Effort, 3> efforts{{
    {2, 1, 1, 0, 0, 0, 0, 1, 0, 120.0F, 120.0F, 0.6F},
    {2, 2, 2, 1, 0, 0, 1, 1, 1, 10.0F, 10.0F, 0.5F},
    {3, 2, 6, 4, 4, 4, 6, 4, 4, 0.0F, 60.0F, 0.3F},
}};

// The best candidates of a block in one family, best first.
struct Ranked {
    float estimate[most_kept];
    std::uint8_t number[most_kept];
};

// The error of a block's bytes, or its limit: squared errors of colour and of alpha, summed, and the
// square of the largest difference of a colour's channel.
struct Errors {
    float color;
    float alpha;
    float worst;
};

// A block while it is searched: which one of its row, what its bytes now leave (error: weighted), what the
// tier below left, and what is to be tried. Families: partitions of two subsets for 8 and for 4 places, of
// three for 8 and for 4, rotations.
struct Task {
    std::uint32_t column;
    float error;
    Errors left;
    Errors limit;
    Ranked ranked[5];
};

constexpr std::size_t most_tasks = 256;

// Room for the blocks of a row, or of a part of it.
struct Scratch {
    Task tasks[most_tasks];
    std::uint16_t jobs[most_tasks];
    std::uint8_t kinds[most_tasks];
};

} // namespace paradize::bc7
