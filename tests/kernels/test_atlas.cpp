// Atlas kernels without Python: what the sanitizers see runs here.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "atlas/charts.hpp"
#include "atlas/pack.hpp"
#include "reference/atlas.hpp"
#include "reference/draw.hpp"

using namespace paradize;

namespace {

// A wavy sheet of n x n quads, about the origin, one unit wide.
struct Sheet {
    std::vector<double> positions;
    std::vector<std::uint32_t> triangles;

    explicit Sheet(std::uint32_t n, double height) {
        for (std::uint32_t y = 0; y <= n; ++y) {
            for (std::uint32_t x = 0; x <= n; ++x) {
                const double u = double(x) / n - 0.5, v = double(y) / n - 0.5;
                positions.insert(positions.end(), {u, height * std::sin(9 * u) * std::cos(7 * v), -v});
            }
        }
        for (std::uint32_t y = 0; y < n; ++y) {
            for (std::uint32_t x = 0; x < n; ++x) {
                const std::uint32_t a = y * (n + 1) + x, b = a + 1, c = a + n + 1, d = c + 1;
                triangles.insert(triangles.end(), {a, b, d, a, d, c});
            }
        }
    }
};

} // namespace

TEST_CASE("a sheet is laid out and packed without overlap, with any number of threads") {
    for (const double height : {0.0, 0.1, 0.6}) {
        const Sheet sheet(20, height);
        const auto one = atlas::make_charts({sheet.positions, sheet.triangles}, 0.3, 1000, 1);
        const auto many = atlas::make_charts({sheet.positions, sheet.triangles}, 0.3, 1000, 5);
        CHECK(one.corners == many.corners);
        CHECK(one.chart == many.chart);
        auto packed = atlas::pack(one.corners, one.chart, one.count, 256, 4);
        REQUIRE(packed.corners.size() == one.corners.size());
        CHECK(packed.texels_per_unit > 50);
        for (double &value : packed.corners) {
            value /= 256;
        }
        const reference::Layout layout{sheet.positions, sheet.triangles, packed.corners};
        const auto raster = reference::layout_raster(packed.corners, reference::charts_of(layout), 256, 3);
        CHECK(raster.covered > 20000);
        CHECK(raster.twice == 0);
        CHECK(raster.near == 0);
        const auto quality = reference::layout_quality(layout);
        CHECK(quality.stretch < 1.05);
        CHECK(quality.flipped == 0);
        CHECK(quality.without == 0);
    }
}

TEST_CASE("triangles on a line and on a point come back, finite") {
    const std::vector<double> positions{0, 0, 0, 0.5, 0, 0, 1, 0, 0, 0, 0, 0};
    const std::vector<std::uint32_t> triangles{0, 1, 2, 0, 3, 0};
    const auto found = atlas::make_charts({positions, triangles}, 0.5, 1000, 2);
    CHECK(std::ranges::all_of(found.corners, [](double v) { return std::isfinite(v); }));
    const auto packed = atlas::pack(found.corners, found.chart, found.count, 64, 2);
    CHECK(std::ranges::all_of(packed.corners, [](double v) { return v >= 0 && v <= 64; }));
}

TEST_CASE("what cannot fit is told by no corners") {
    std::vector<double> corners;
    std::vector<std::int32_t> chart;
    for (std::int32_t k = 0; k < 500; ++k) {
        corners.insert(corners.end(), {0, 0, 1, 0, 0, 1});
        chart.push_back(k);
    }
    CHECK(atlas::pack(corners, chart, 500, 32, 8).corners.empty());
}

TEST_CASE("costs of drawing are counted for any order") {
    const Sheet sheet(8, 0);
    const std::vector<std::uint32_t> strides{12, 8};
    const std::size_t vertices = sheet.positions.size() / 3;
    const auto cost = reference::draw_cost(sheet.triangles, vertices, 16, strides, 64);
    CHECK(cost.acmr > 0.5);
    CHECK(cost.atvr >= 1);
    CHECK(cost.overfetch >= 1);
}
