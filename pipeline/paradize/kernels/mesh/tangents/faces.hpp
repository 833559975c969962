// The inputs of tangent frames for each vertex and each triangle.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mesh/buffer.hpp"
#include "mesh/tangents/tangents.hpp"

namespace paradize::mesh {

// The values of a welded vertex; the normal unit, or zero where it has no direction.
struct alignas(32) WeldedVertex {
    float position[3];
    float normal[3];
    float uv[2];
};

// Vertices that agree in position, normal and uv are one.
struct Welded {
    std::size_t count;
    Buffer<std::uint32_t> number; // of each vertex
    Buffer<std::uint32_t> first;  // a vertex with each number
    Buffer<WeldedVertex> spots;   // by number
};
Welded weld(const Surface &surface);

enum FaceFlags : std::uint32_t {
    face_preserves = 1, // the image is not mirrored on it
    face_any = 2,       // without area in the image: it follows its neighbours
    face_flat = 4,      // two corners at one position
};

// pull: for each corner, the direction of growing u in the plane of that corner's normal, as long as the
// corner's angle in that plane; zero where there is none. down: unit direction of growing v.
struct alignas(64) Face {
    std::uint32_t vertex[3]; // welded
    std::uint32_t flags;
    float pull[3][3];
    float down[3];
};

// Fills faces [first, last).
void measure_faces(const Surface &surface, const Welded &welded, Face *faces, std::size_t first,
                   std::size_t last);

} // namespace paradize::mesh
