// How much of the light from all around reaches points of a surface: cosine-weighted rays, and which of them
// meet a triangle.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "occlusion/directions.hpp"
#include "occlusion/tree.hpp"
#include "simd/cpu.hpp"

namespace paradize::occlusion {

// A point and the directions about it, for one of the instruction sets.
struct Point {
    float origin[3];
    float frame[3][3]; // tangent, bitangent, normal: unit and at right angles
    float face[3]; // rays with a negative product with it would begin below the surface: they do not count
};

struct Share {
    std::uint32_t open, all; // rays that met nothing; rays that count
};

#define PARADIZE_CAST(width)                                                                                 \
    namespace width {                                                                                        \
    Share cast(const Tree &tree, const Point &point, const float *x, const float *y, const float *z,         \
               std::size_t rays, float reach);                                                               \
    }
PARADIZE_EACH_WIDTH(PARADIZE_CAST)
#undef PARADIZE_CAST

// The open share of each point: open / all rays, 0..1; 1 where no ray counts.
// points, normals, faces: (n, 3); normals and faces unit, with a product of 0 or more. texels: (n,), flat
// indices on a map of so many columns: they choose the directions. reach: length of the rays. width: 0: the
// widest that the CPU runs; 1, 2, 3: 4, 8, 16 rays at a time.
void cast_all(const Tree &tree, std::span<const float> points, std::span<const float> normals,
              std::span<const float> faces, std::span<const std::uint32_t> texels, std::size_t columns,
              const Directions &directions, float reach, std::span<float> out, int threads, int width);

bool has_width(int width);

} // namespace paradize::occlusion
