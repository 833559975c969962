// How good a UV layout is. For metrics only: no stage uses this kernel.
// Source of the stretch: P. Sander, J. Snyder, S. Gortler and H. Hoppe, "Texture mapping progressive meshes",
// 2001.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace paradize::reference {

struct Layout {
    std::span<const double> positions;        // (n, 3), metres
    std::span<const std::uint32_t> triangles; // (m, 3), one index per place
    std::span<const double> corners;          // (m, 3, 2), texture coordinates in 0..1
};

struct LayoutQuality {
    double stretch = 0; // L2: 1 at best; root mean square over the surface of how much longer a unit of the
                        // image is there, sizes made equal
    double seam_length = 0; // edges of two triangles whose corners differ in the image, in the square root of
                            // the surface's area
    double packing = 0;     // share of the unit square inside triangles, overlaps counted twice
    // Triangles that are too thin for float32 coordinates to tell are not in what follows.
    std::uint64_t flipped = 0;   // triangles whose image turns the other way than most, by area
    std::uint64_t without = 0;   // triangles with an area on the surface and none in the image
    std::uint32_t charts = 0;    // sets of triangles that share edges on both sides
    std::vector<double> density; // per triangle with an area: texture units per metre
};

LayoutQuality layout_quality(const Layout &layout);

struct LayoutRaster {
    std::uint64_t covered = 0; // texels whose centre is inside a triangle
    std::uint64_t twice = 0;   // inside two, by more than a thousandth of a texel
    std::uint64_t near = 0;    // texels that a chart reaches a thousandth into which another touches or comes
                               // nearer to than `gap`
};

// chart: (m), which chart a triangle is in, from 0. resolution: texels of the square's side, 1 to 16384; gap:
// how many texels are to lie free between two charts, 0 to 64.
LayoutRaster layout_raster(std::span<const double> corners, std::span<const std::int32_t> chart,
                           std::uint32_t resolution, std::uint32_t gap);

// The chart of each triangle: triangles are of one where they share an edge on the surface and in the image.
std::vector<std::int32_t> charts_of(const Layout &layout);

} // namespace paradize::reference
