// Height field -> hierarchy of right triangles with a true bound, for rectangles of any size.
// Bisection: Evans, Kirkpatrick, Townsend, "Right-Triangulated Irregular Networks", 2001. What is ours: every
// triangle that stays is measured at every pixel that it covers, not at the middle of its longest side alone;
// and the grid of powers of two is laid over the pixels so that its cells are one or two pixels wide,
// whose last pixels the finest triangles take in where they must.
#pragma once

#include <cstdint>
#include <span>

#include "terrain/delaunay.hpp"

namespace paradize::terrain {

// As `refine`: same inputs, same bound, same promise of equal bytes.
Triangulation bisect(std::span<const float> heights, std::uint32_t width, std::uint32_t height,
                     double tolerance, int threads);

} // namespace paradize::terrain
