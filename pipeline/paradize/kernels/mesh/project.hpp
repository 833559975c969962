// For every corner of a simplified mesh, the place on the original surface whose attributes it takes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace paradize::mesh {

struct Places {
    std::vector<std::uint32_t> triangle; // (corners,) of the original
    std::vector<double> weights;         // (corners, 3) barycentric, 0..1, sum 1
};

// source_*: the original, positions (n, 3), triangles (m, 3), m > 0; charts: (m,) a number per triangle,
// equal where attributes run on without a seam. positions, triangles: the simplified mesh, in the same space,
// all finite. A corner is looked up a little inside its triangle, among original triangles that face the same
// way, so that the side of a seam, of a hard edge or of a sheet is never mistaken; then moved to the point
// nearest to the corner itself. Corners that share a vertex and meet the same chart share one place.
Places project(std::span<const float> source_positions, std::span<const std::uint32_t> source_triangles,
               std::span<const std::uint32_t> charts, std::span<const float> positions,
               std::span<const std::uint32_t> triangles, bool one_chart);

} // namespace paradize::mesh
