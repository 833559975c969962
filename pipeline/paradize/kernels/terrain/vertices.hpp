// The attributes of a terrain vertex, from its pixel and the height field alone: so that meshes of parts
// have the same where they meet.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace paradize::terrain {

struct HeightField {
    std::span<const float> heights; // rows x columns, metres; 2 or more each way
    std::size_t rows, columns;
    double size_x_m, size_z_m; // first to last pixel
    double sand_repeat;        // times the first UV set repeats along x; along z it keeps its tiles square
};

// One element a vertex: positions and normals 3 floats, tangents 4, both UV sets 2.
struct VertexArrays {
    float *positions, *normals, *tangents, *uvs, *uvs1;
};

// pixels: (row, column) of each vertex, in the field. Normals and tangents by central differences, one-sided
// on the rim, in float64; T along +X, w = +1. The bits do not depend on `threads`.
void vertices_of(const HeightField &height_field, std::span<const std::uint32_t> pixels,
                 const VertexArrays &out, int threads);

// Every pixel a vertex, row by row, and two triangles a cell, facing up: 6 * (rows - 1) * (columns - 1)
// indices.
void whole_grid(const HeightField &height_field, const VertexArrays &out, std::uint32_t *triangles,
                int threads);

} // namespace paradize::terrain
