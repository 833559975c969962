// A right triangle of pixel space, clipped by the field, as a Delaunay triangulation with fixed borders: what
// stands on a border depends on that border alone, so that patches meet without cracks, whoever makes them.
// The bintree of such patches: Cignoni, Ganovelli, Gobbetti, Marton, Ponchio, Scopigno, "BDAM: Batched
// Dynamic Adaptive Meshes for High Performance Terrain Visualization", 2003.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "terrain/delaunay.hpp"

namespace paradize::terrain {

struct Point { // of the grid of pixels, also outside the field
    std::int32_t x, y;
};

// >= 0, in the unit of the heights: of pixels inside and on the field's rim where it cuts the triangle; of
// those on the hypotenuse; of those on a leg.
struct PatchBounds {
    double inside, hypotenuse, leg;
};

// The right angle first. True when the legs are of one length, along rows and columns or along diagonals.
bool is_patch(const std::array<Point, 3> &corners);

// heights as in `refine`. Returns nothing where the triangle covers no area of the field. most: inner
// vertices are added, the worst pixel first, as long as the patch has fewer vertices than that; then it may
// exceed `inside`.
Triangulation patch(std::span<const float> heights, std::uint32_t width, std::uint32_t height,
                    const std::array<Point, 3> &corners, const PatchBounds &bounds, std::size_t most);

} // namespace paradize::terrain
