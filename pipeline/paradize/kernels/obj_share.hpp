// Vertices of a file: corners with the same indices are one, then those with the same values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "obj_assemble.hpp"

namespace paradize::obj {

struct IndexShared {
    Buffer<std::uint32_t> vertex_of_corner; // number of each corner's vertex, in the order of first use
    Buffer<Corner> vertices;                // what each vertex refers to
};

// Corners with equal indices share a vertex. positions: how many there are.
IndexShared share_by_index(std::span<const Corner> corners, std::size_t positions);

// One attribute of the vertices: rows of `width` floats of the file, taken by index `kind` (0: position, 1:
// uv, 2: normal) into `out`. Where the index is absent the row is zeros. A uv's second number is turned to
// the top.
struct Piece {
    std::span<const float> rows;
    std::size_t width;
    int kind;
    Buffer<float> *out;
};

// Fills in the pieces' rows for all vertices; those with equal rows in all pieces (0 equals -0) become one,
// numbered in order of first use, and `triangles` follow.
void share_by_value(std::span<const Corner> vertices, std::span<const Piece> pieces,
                    Buffer<std::uint32_t> &triangles);

} // namespace paradize::obj
