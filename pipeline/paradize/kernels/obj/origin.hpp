// Where the positions of a file are counted from, so that float32 holds them.
#pragma once

#include <array>
#include <span>

#include "obj/assemble.hpp"

namespace paradize::obj {

using Origin = std::array<double, 3>;

// (0, 0, 0) where float32 holds the used positions as they are; else a place in their midst: on each axis a
// multiple of a power of two that is at most their spread, so that float32 holds it as long as it can.
// It is another place where
// - a coordinate reaches farther from 0 than 8 diagonals of the bounding box: up to there rounding moves none
//   by more than sqrt(3) * 8 * 2^-24 of the diagonal, 8.3e-7;
// - or half of the edges would be moved by more than a thousandth of their length, and by a sixteenth of that
//   from the place: most of the model lies far away, and some of it does not.
// positions: 3 each.
Origin origin_of(std::span<const double> positions, std::span<const Corner> corners);

} // namespace paradize::obj
