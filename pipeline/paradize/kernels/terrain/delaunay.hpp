// Height field -> Delaunay triangulation that honours a vertical error bound at every pixel: tiles meshed
// apart, sewn, made Delaunay across their seams, and the seams' needless vertices taken out again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "terrain/mesher.hpp"

namespace paradize::terrain {

struct Triangulation {
    std::vector<std::uint32_t> pixels;    // row * width + column of each vertex, in order of first use
    std::vector<std::uint32_t> triangles; // 3 indices into `pixels` each; positive area in (column, row)
};

// heights: width * height finite floats, row by row; width, height in [2, 16385]; tolerance >= 0 in the unit
// of the heights: at every pixel the plane of each triangle that covers it lies within the tolerance (in
// float64, of exact pixel positions). Exact predicates: the result is a Delaunay triangulation whatever the
// input, and the same on every CPU and any number of threads.
Triangulation refine(std::span<const float> heights, std::uint32_t width, std::uint32_t height,
                     double tolerance, int threads);

// The living triangles of a net of a field `width` pixels wide.
Triangulation listed(HalfEdgeMesh &&net, std::uint32_t width);

} // namespace paradize::terrain
