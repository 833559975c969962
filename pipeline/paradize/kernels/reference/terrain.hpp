// The vertical distance of a finished terrain mesh from every pixel of its height field, by brute force in
// float64: it knows only positions and triangles, and nothing of how they were found.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace paradize::reference {

struct HeightField {
    std::span<const float> heights; // rows x columns, metres
    std::size_t rows, columns;
    double size_x_m, size_z_m; // first to last pixel
};

// max_m, squares: over the covered pixels, the farthest triangle at each. worst: the first pixel (row *
// columns + column) with the largest error. holes: pixels without a triangle. flipped: triangles that face
// down or have no area.
struct TerrainError {
    double max_m = -1.0, squares = 0.0;
    std::uint64_t covered = 0, holes = 0, flipped = 0, worst = 0;
};

// positions: n x 3; triangles: m x 3 indices below n. Works in bands of rows, so that no array of the whole
// field's size is made; the bits do not depend on `threads`.
TerrainError terrain_error(std::span<const float> positions, std::span<const std::uint32_t> triangles,
                           const HeightField &height_field, int threads);

// A pixel, also outside the field.
struct GridPoint {
    std::int64_t row, column;
};

// As TerrainError, of the pixels of the field that lie in a closed triangle. strays: pixels outside it that
// the mesh covers.
struct PatchError {
    TerrainError inside;
    std::uint64_t strays = 0;
};

// The mesh of one patch, in its place in the whole field: brute force over every pixel of the closed triangle
// `corners`. A pixel on the triangle's sides is also measured against the sides of faces that lie there
// (within a millionth of the field's side), as it belongs to the patch, whatever float32 did to the
// positions.
PatchError patch_error(std::span<const float> positions, std::span<const std::uint32_t> triangles,
                       const HeightField &height_field, const std::array<GridPoint, 3> &corners);

} // namespace paradize::reference
