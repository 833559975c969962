// Height field -> Delaunay triangulation that honours a vertical error bound at every pixel.
// Greedy insertion: Garland and Heckbert, "Fast Polygonal Approximation of Terrains and Height Fields", 1995.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace paradize::terrain {

struct Triangulation {
    std::vector<std::uint32_t> pixels;    // row * width + column of each vertex, in order of first use
    std::vector<std::uint32_t> triangles; // 3 indices into `pixels` each; positive area in (column, row)
};

// heights: width * height finite floats, row by row; width, height in [2, 32768]; tolerance >= 0 in the unit
// of the heights: at every pixel the plane of each triangle that covers it lies within the tolerance (in
// float64, of exact pixel positions). Exact predicates: the result is a Delaunay triangulation whatever the
// input.
Triangulation refine(std::span<const float> heights, std::uint32_t width, std::uint32_t height,
                     double tolerance);

} // namespace paradize::terrain
