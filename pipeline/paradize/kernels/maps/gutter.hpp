// UV islands as texels, and the gutter that surrounds them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace paradize::maps {

// Which island each triangle belongs to: triangles that share a UV point share an island.
//   uvs: n * 2 floats; triangles: m * 3 indices below n; returns m ids from 0, in order of first appearance
std::vector<std::int32_t> uv_islands(std::span<const float> uvs, std::span<const std::uint32_t> triangles);

// ids, one per triangle (>= 0), drawn into out (rows * columns; -1 where no triangle is).
// A texel takes the first triangle that covers its centre, else the first that covers any part of it
// (conservative: no texel that a triangle touches stays empty; not `touched`: of centres alone). A triangle
// without area shows the texels along its line or around its point, and covers what of them no other triangle
// does. UVs are top-left; those outside 0..1 wrap. Throws std::length_error when the UVs tile so often that
// their rows, in all of their tiles, are more than work_limit.
void rasterise(std::span<const float> uvs, std::span<const std::uint32_t> triangles,
               std::span<const std::int32_t> ids, std::size_t rows, std::size_t columns, double work_limit,
               std::span<std::int32_t> out, bool touched = true);

// For each texel the index of the nearest covered one (itself where covered; -1 where none is covered),
// by Euclidean distance, the smaller index among equals of a row.
// Source: A. Meijster, J. Roerdink and W. Hesselink, "A general algorithm for computing distance transforms
// in linear time", 2000: integers only.
void nearest_covered(std::span<const std::uint8_t> covered, std::size_t rows, std::size_t columns,
                     bool wrap_x, bool wrap_y, std::span<std::int32_t> out, int threads);

} // namespace paradize::maps
