// The hierarchy of right triangles, the patches and the reference rasteriser without Python.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "reference/terrain.hpp"
#include "rough_grid.hpp"
#include "terrain/patch.hpp"
#include "terrain/rtin.hpp"

using paradize::terrain::bisect;
using paradize::terrain::patch;
using paradize::terrain::Point;
using paradize::terrain::Triangulation;

namespace {

paradize::reference::HeightField field_of(const Grid &grid) {
    return {grid.heights, grid.height, grid.width, static_cast<double>(grid.width - 1),
            static_cast<double>(grid.height - 1)};
}

// Positions about the origin, a metre a pixel, and triangles that face up.
struct Placed {
    std::vector<float> positions;
    std::vector<std::uint32_t> triangles;
};

Placed placed(const Grid &grid, const Triangulation &found) {
    Placed mesh;
    for (const std::uint32_t pixel : found.pixels) {
        mesh.positions.push_back(static_cast<float>(pixel % grid.width) -
                                 static_cast<float>(grid.width - 1) / 2.0F);
        mesh.positions.push_back(grid.heights[pixel]);
        mesh.positions.push_back(static_cast<float>(pixel / grid.width) -
                                 static_cast<float>(grid.height - 1) / 2.0F);
    }
    for (std::size_t t = 0; t < found.triangles.size(); t += 3) {
        mesh.triangles.insert(mesh.triangles.end(),
                              {found.triangles[t], found.triangles[t + 2], found.triangles[t + 1]});
    }
    return mesh;
}

std::int64_t doubled_area(const Grid &grid, const Triangulation &found) {
    std::int64_t sum = 0;
    for (std::size_t t = 0; t < found.triangles.size(); t += 3) {
        std::int64_t x[3], y[3];
        for (std::size_t k = 0; k < 3; ++k) {
            x[k] = found.pixels[found.triangles[t + k]] % grid.width;
            y[k] = found.pixels[found.triangles[t + k]] / grid.width;
        }
        const std::int64_t area = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0]);
        CHECK(area > 0);
        sum += area;
    }
    return sum;
}

} // namespace

TEST_CASE("right triangles keep any bound and cover the grid exactly once") {
    for (const auto &[width, height] :
         {std::pair{2U, 2U}, {2U, 17U}, {17U, 2U}, {33U, 33U}, {33U, 20U}, {50U, 37U}}) {
        const Grid grid = rough(width, height, 7);
        for (const double tolerance : {0.0, 0.1, 0.7, 5.0}) {
            const Triangulation found = bisect(grid.heights, width, height, tolerance, 2);
            CHECK(doubled_area(grid, found) == 2 * std::int64_t{width - 1} * (height - 1));
            const Placed mesh = placed(grid, found);
            const auto error =
                paradize::reference::terrain_error(mesh.positions, mesh.triangles, field_of(grid), 2);
            CHECK(error.holes == 0);
            CHECK(error.flipped == 0);
            CHECK(error.max_m <= tolerance + 1e-6);
        }
    }
}

TEST_CASE("patches keep their bounds and cover the grid exactly once, clipped or not") {
    const Grid grid = rough(45, 34, 7);
    for (const double tolerance : {0.0, 0.7, 5.0}) {
        std::int64_t area = 0;
        const std::array<std::array<Point, 3>, 4> quarters{{{{{32, 32}, {0, 0}, {64, 0}}},
                                                            {{{32, 32}, {64, 0}, {64, 64}}},
                                                            {{{32, 32}, {64, 64}, {0, 64}}},
                                                            {{{32, 32}, {0, 64}, {0, 0}}}}};
        for (const auto &corners : quarters) {
            const Triangulation found =
                patch(grid.heights, 45, 34, corners, {tolerance, tolerance, tolerance / 2}, 1U << 31);
            area += doubled_area(grid, found);
            const Placed mesh = placed(grid, found);
            const auto error = paradize::reference::patch_error(
                mesh.positions, mesh.triangles, field_of(grid),
                {{{corners[0].y, corners[0].x}, {corners[1].y, corners[1].x}, {corners[2].y, corners[2].x}}});
            CHECK(error.inside.holes == 0);
            CHECK(error.inside.flipped == 0);
            CHECK(error.strays == 0);
            CHECK(error.inside.max_m <= tolerance + 1e-6);
        }
        CHECK(area == 2 * 44 * 33);
    }
}

TEST_CASE("the reference rasteriser measures what is known") {
    Grid grid{5, 5, std::vector<float>(25, 0.0F)};
    grid.heights[12] = 3.0F;
    grid.heights[7] = -1.0F;
    Placed mesh{{-2, 0, -2, 2, 0, -2, -2, 0, 2, 2, 0, 2}, {0, 2, 3, 0, 3, 1}};
    for (const int threads : {1, 3}) {
        const auto error =
            paradize::reference::terrain_error(mesh.positions, mesh.triangles, field_of(grid), threads);
        CHECK(error.max_m == 3.0);
        CHECK(error.worst == 12);
        CHECK(error.squares == 10.0);
        CHECK(error.covered == 25);
        CHECK(error.holes == 0);
        CHECK(error.flipped == 0);
    }
    mesh.triangles = {0, 2, 3};
    CHECK(paradize::reference::terrain_error(mesh.positions, mesh.triangles, field_of(grid), 1).holes == 10);
    mesh.triangles = {0, 3, 2, 0, 1, 3};
    CHECK(paradize::reference::terrain_error(mesh.positions, mesh.triangles, field_of(grid), 1).flipped == 2);
    mesh.triangles = {0, 2, 3, 0, 3, 1};
    const auto half = paradize::reference::patch_error(mesh.positions, mesh.triangles, field_of(grid),
                                                       {{{0, 0}, {0, 4}, {4, 0}}});
    CHECK(half.inside.covered == 15);
    CHECK(half.strays == 10);
    CHECK(half.inside.max_m == 3.0);
}

TEST_CASE("the reference rasteriser takes the worst of two surfaces, one above the other") {
    const Grid grid{3, 3, std::vector<float>(9, 0.0F)};
    const Placed mesh{{-1, 0, -1, 1, 0, -1, -1, 0, 1, 1, 0, 1, -1, 2, -1, 1, 2, -1, -1, 2, 1},
                      {0, 2, 3, 0, 3, 1, 4, 6, 5}};
    const auto error = paradize::reference::terrain_error(mesh.positions, mesh.triangles, field_of(grid), 1);
    CHECK(error.max_m == 2.0);
    CHECK(error.squares == 6 * 4.0);
}
