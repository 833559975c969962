// Tangent-space normals of a height field: n = (-dh/dx, dh/drow, 1) / |.|, green up the image.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "normals/sweep.hpp"

namespace paradize::normals {

// Rows [first, last) of the normals of heights (rows * columns), written one after the other to `out`
// (x y z each).
//   islands: empty, or one id per texel, negative outside. A texel of whose taps any lies on another island
//   takes each such tap, and those outside the map, from the odd reflection about itself:
//   h = 2 h[here] - h[opposite]; where a pair of taps is lost as a whole the axis takes the difference of the
//   next texels of the island: central, one-sided or none.
// Throws NotFinite when a height that was read is not finite, std::invalid_argument where this CPU lacks
// `width`.
void normals_from_heights(std::span<const float> heights, std::size_t rows, std::size_t columns,
                          std::span<const std::int32_t> islands, const Settings &settings, std::size_t first,
                          std::size_t last, std::span<float> out, int threads, Width width = Width::widest);

// The normals of slopes dx and dy (rows * columns), per texel along the rows and down the columns, times
// their scale.
void normals_from_slopes(std::span<const float> dx, std::span<const float> dy, std::size_t rows,
                         std::size_t columns, double scale_x, double scale_y, bool green_down,
                         std::span<float> out, int threads, Width width = Width::widest);

// The table of `width`; throws std::invalid_argument where this CPU lacks it.
const Kernels &need_kernels(Width width);

} // namespace paradize::normals
