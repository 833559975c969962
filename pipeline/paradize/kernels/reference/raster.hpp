// Draws the triangles of a mesh into tiles of a picture, in software, with float64: the normals and the light
// of the nearest ones. What seen.hpp measures of pictures.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "reference/seen.hpp"

namespace paradize::reference {

constexpr std::size_t tile = 32; // pixels along a side

using Pair = std::array<double, 2>;

// The vector with length 1, or zero.
Point unit(const Point &v);

// The axes of a picture and its place: x = (right . p) * scale + left in samples, y upwards, z towards the
// viewer.
struct View {
    Point right, up, toward;
    double scale = 0, left = 0, bottom = 0;

    Point of(const float *p) const {
        const Point at{p[0], p[1], p[2]};
        return {dot(right, at) * scale + left, dot(up, at) * scale + bottom, dot(toward, at)};
    }
};

// toward: unit, towards the viewer.
View looking(const Point &toward);

// A triangle in a picture: the shares of its second and third corner are linear in x and y.
struct PlacedTriangle {
    Point first{};
    Pair second_by{}, third_by{}; // by x, by y
    double nearer_second = 0, nearer_third = 0;
    bool drawn = false, back = false;

    Pair shares(double x, double y) const {
        const double dx = x - first[0], dy = y - first[1];
        return {second_by[0] * dx + second_by[1] * dy, third_by[0] * dx + third_by[1] * dy};
    }
};

// The levels of a triangle's maps that a picture shows; null where there is none.
struct Maps {
    const Mip *normal = nullptr, *color = nullptr, *glow = nullptr;
};

// A mesh in a picture.
struct Placed {
    const SeenMesh &mesh;
    std::vector<Point> at; // by vertex

    // PlacedTriangle t, and whether it is drawn.
    PlacedTriangle triangle(std::size_t t) const;

    // Texture coordinates at shares of a triangle.
    Pair uv(std::size_t t, const Pair &shares) const;

    // The level of a chain whose texels are about as wide as a sample; its coarsest without texture
    // coordinates, null of an empty chain.
    const Mip *level(std::size_t t, const PlacedTriangle &shape, const std::vector<Mip> &chain) const;

    // A map of three channels at shares of a triangle: its first texel without texture coordinates.
    Point shown(std::size_t t, const Pair &shares, const Mip *map, double without) const;

    // The light that a sample sends to the viewer.
    Point lit(std::size_t t, const Maps &maps, const Pair &shares, const Point &normal,
              const SeenLight &light) const;

    // The unit normal at shares of a triangle, towards the viewer, with a level of its normal map or null.
    Point normal(std::size_t t, const PlacedTriangle &shape, const Mip *map, const Pair &shares) const;
};

// mesh: must outlive the result.
Placed place(const SeenMesh &mesh, const View &view, int threads);

// Tiles around a triangle.
struct Box {
    std::size_t left, right, bottom, top; // the last ones included
};

// Which triangles lie in which tile. Tiles are numbered row by row.
class Bins {
  public:
    Bins(const Placed &placed, std::size_t columns, std::size_t rows, double side)
        : placed_(placed), columns_(columns), rows_(rows), side_(side) {}

    // The tiles around triangle t; false where it is not drawn.
    bool box(std::size_t t, Box &out) const;

    // Adds the number of triangles in each tile, and returns how many samples their boxes hold.
    double count(std::vector<std::uint32_t> &tiles) const;

    // Lists the triangles of the tiles in `chosen` (rising); `first` has one more than these.
    void fill(const std::vector<std::size_t> &chosen);

    std::vector<std::size_t> first;
    std::vector<std::uint32_t> triangles;

  private:
    const Placed &placed_;
    std::size_t columns_, rows_;
    double side_; // samples
};

// The pixels of a tile: the sums of the normals and of the light of their samples, and how many are covered.
struct TilePixels {
    std::array<Point, tile * tile> normal{}, light{};
    std::array<std::uint32_t, tile * tile> covered{};
};

// Adds the triangles that face the viewer to the pixels of a tile. left, bottom: its first sample; samples:
// of a pixel along a side; light: null where nobody asks for it.
void draw(const Placed &placed, std::span<const std::uint32_t> triangles, std::size_t left,
          std::size_t bottom, std::size_t samples, const SeenLight *light, TilePixels &out);

// About `share` [0, 1] of the tiles that are not empty, at least one, evenly spread.
std::vector<std::size_t> some(const std::vector<std::uint32_t> &tiles, double share);

} // namespace paradize::reference
