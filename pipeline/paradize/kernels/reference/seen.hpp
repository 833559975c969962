// Draws two meshes into pictures of the same size: the mean normal and the coverage of each pixel, or its
// light. For metrics only: no stage uses this kernel. Source: M. Olano and D. Baker, "LEAN mapping", 2010,
// for why a pixel's mean normal is what light sees of the surfaces under it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "reference/places.hpp"
#include "reference/tree.hpp"

namespace paradize::reference {

// A level of a map: (rows, columns, channels) floats.
struct Mip {
    std::span<const float> texels;
    std::size_t rows = 0, columns = 0;
};

// The look of a material. Chains start with the finest level.
struct SeenMaterial {
    std::vector<Mip> normals;                        // unit vectors, green up; none: as if flat
    std::vector<Mip> alpha;                          // one channel; none: no holes
    std::vector<Mip> colors;                         // linear; none: white
    std::vector<Mip> glow;                           // light of its own, linear; none: black
    double cutoff = 0;                               // what has less alpha is a hole
    Wrap across = Wrap::repeat, down = Wrap::repeat; // of its maps, beyond their edges
    bool two_sided = false;
};

// material: (m,) row of `materials`, by triangle. Without normals (n = 0) a triangle shows its own.
struct SeenMesh {
    Surface surface;
    Shading shading;
    std::span<const std::uint32_t> material;
    std::vector<SeenMaterial> materials;
    std::span<const float> colors = {}; // (n, 4) linear, times those of the material, or empty
};

// Pixels are counted by how much of them is covered. Angles: degrees between the mean normals of what is
// covered of a pixel, weighted by what both pictures cover of it. A mean of normals that differ is shorter
// than 1: its angle to another is that whose chord on the unit sphere is as long as their difference. So a
// change counts by what the light sees of it.
struct SeenDifference {
    double mean = 0, p99 = 0, max = 0;
    double covered = 0; // pixels, by the first mesh
    double changed = 0; // pixels covered by one and not by the other
    double box = 0;     // pixels of the rectangle around both
};

// Limits on the difference of all pictures together. changed: as a share of box.
struct SeenLimits {
    double p99 = std::numeric_limits<double>::infinity();
    double changed = std::numeric_limits<double>::infinity();
};

// Orthographic pictures along `directions` (towards the viewer, unit) with pixels of `pixel` (> 0, unit of
// the positions), each of samples x samples samples. A sample shows the nearest triangle that faces the
// viewer, or the nearest of any side where it is two-sided, with its normal turned round. Of a large picture
// about `most_tiles` tiles of 32 x 32 pixels are measured, evenly spread over those that are not empty.
// Returns one difference for each direction, and last that of all pictures together; nothing as soon as it is
// certain that they are beyond `limits`.
//
// A picture's right is (0, 1, 0) x direction, or (0, 0, 1) x direction where the direction is within 26
// degrees of the Y axis; up is direction x right. Its first pixel starts (0.5717, 0.5393) pixels to the left
// of and below all triangles of both meshes. Samples lie in the middles of their squares.
std::vector<SeenDifference> seen_differences(const SeenMesh &a, const SeenMesh &b,
                                             std::span<const double> directions, double pixel,
                                             std::size_t samples, std::size_t most_tiles,
                                             const SeenLimits &limits, int threads);

// One direction of light, and light from all around that is strongest from above.
struct SeenLight {
    Point toward{}; // unit, towards the light
    double direct = 0, around = 0;
};

// (rows, columns, 4): red, green and blue, linear, of what is covered of a pixel, and how much of it is.
struct LitPicture {
    std::vector<float> pixels;
    std::size_t rows = 0, columns = 0;
};

// low, high: the pixels around the bounding box of the first mesh, by column and row, whole numbers; they may
// lie beyond the pictures.
struct LitPair {
    LitPicture first, second;
    std::array<double, 2> low{}, high{};
};

// The pictures of two meshes along `toward` (unit), laid out as those above with `margin` pixels more on all
// sides, the lowest row first. A surface is its color times the light on it, and its glow.
LitPair lit_pictures(const SeenMesh &a, const SeenMesh &b, const Point &toward, double pixel,
                     std::size_t samples, std::size_t margin, const SeenLight &light);

} // namespace paradize::reference
