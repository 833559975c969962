// Greedy terrain triangulation without Python: it covers the grid once and keeps its bound at every pixel.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "rough_grid.hpp"
#include "terrain/delaunay.hpp"

using paradize::terrain::refine;
using paradize::terrain::Triangulation;

namespace {

// The largest error over all pixels of all triangles, by visiting every pixel of every bounding box; and
// twice the area that they cover.
struct Measured {
    double error = 0.0;
    std::int64_t doubled_area = 0;
    bool all_turn_one_way = true;
};

Measured measure(const Grid &grid, const Triangulation &found) {
    Measured result;
    for (std::size_t t = 0; t < found.triangles.size(); t += 3) {
        std::int64_t x[3], y[3];
        double z[3];
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t pixel = found.pixels[found.triangles[t + k]];
            x[k] = pixel % grid.width;
            y[k] = pixel / grid.width;
            z[k] = static_cast<double>(grid.heights[pixel]);
        }
        const std::int64_t area = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0]);
        result.doubled_area += area;
        result.all_turn_one_way = result.all_turn_one_way && area > 0;
        for (std::int64_t py = *std::min_element(y, y + 3); py <= *std::max_element(y, y + 3); ++py)
            for (std::int64_t px = *std::min_element(x, x + 3); px <= *std::max_element(x, x + 3); ++px) {
                double plane = 0.0;
                bool inside = true;
                for (int k = 0; k < 3; ++k) {
                    const int a = (k + 1) % 3, b = (k + 2) % 3;
                    const std::int64_t part = (x[a] - px) * (y[b] - py) - (y[a] - py) * (x[b] - px);
                    inside = inside && part >= 0;
                    plane += z[k] * static_cast<double>(part) / static_cast<double>(area);
                }
                if (inside) {
                    const auto pixel =
                        static_cast<std::size_t>(py) * grid.width + static_cast<std::size_t>(px);
                    result.error =
                        std::max(result.error, std::fabs(plane - static_cast<double>(grid.heights[pixel])));
                }
            }
    }
    return result;
}

} // namespace

TEST_CASE("any bound is kept and the grid is covered exactly once") {
    for (const auto &[width, height] : {std::pair{2U, 2U}, {2U, 17U}, {17U, 2U}, {33U, 20U}}) {
        const Grid grid = rough(width, height, 1);
        for (const double tolerance : {0.0, 0.1, 0.7, 5.0}) {
            const Measured found = measure(grid, refine(grid.heights, width, height, tolerance, 2));
            CHECK(found.error <= tolerance + 1e-9);
            CHECK(found.doubled_area == 2 * std::int64_t{width - 1} * (height - 1));
            CHECK(found.all_turn_one_way);
        }
    }
}

TEST_CASE("a flat field needs two triangles, whatever the bound") {
    const Grid grid{40, 30, std::vector<float>(1200, 7.5F)};
    CHECK(refine(grid.heights, 40, 30, 0.0, 2).triangles.size() == 6);
}

TEST_CASE("a spike on an edge, on the rim and inside becomes a vertex") {
    for (const std::uint32_t pixel : {0U, 5U, 11U, 11U * 5U + 5U, 11U * 3U + 7U, 120U}) {
        Grid grid{11, 11, std::vector<float>(121, 0.0F)};
        grid.heights[pixel] = 9.0F;
        const Triangulation found = refine(grid.heights, 11, 11, 0.5, 2);
        CHECK(std::count(found.pixels.begin(), found.pixels.end(), pixel) == 1);
        CHECK(measure(grid, found).error <= 0.5);
    }
}

TEST_CASE("huge heights and tiny bounds end") {
    Grid grid = rough(24, 24, 1);
    for (float &value : grid.heights)
        value *= 1e30F;
    CHECK(measure(grid, refine(grid.heights, 24, 24, 1e20, 2)).error <= 1.1e20);
    const Grid small = rough(24, 24, 1);
    CHECK(refine(small.heights, 24, 24, 1e-300, 2).pixels.size() <= 576);
}
