// The simplifier without Python: what the sanitizers see runs here.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "simplify/collapse.hpp"
#include "simplify/mesh.hpp"
#include "simplify/quadric.hpp"
#include "simplify/queue.hpp"

using namespace paradize;
using simplify::Result;
using simplify::Stop;

namespace {

// A waved open square of side 1, its image upright; a second wedge at x = 1/2 where `seam`.
struct Sheet {
    std::vector<double> positions;
    std::vector<std::uint32_t> triangles;
    std::vector<float> attributes;
    std::vector<float> weights{0.1F, 0.1F};
    std::vector<std::uint32_t> place;
    std::vector<std::uint32_t> group;

    Sheet(std::uint32_t cells, double height, bool seam) {
        const std::uint32_t middle = cells / 2;
        std::vector<std::uint32_t> left, right; // vertex of each grid point, seen from either side
        for (std::uint32_t y = 0; y <= cells; ++y) {
            for (std::uint32_t x = 0; x <= cells; ++x) {
                const double u = static_cast<double>(x) / cells, v = static_cast<double>(y) / cells;
                const auto first = static_cast<std::uint32_t>(place.size());
                left.push_back(first);
                right.push_back(first + (seam && x == middle ? 1 : 0));
                for (std::uint32_t i = first; i <= right.back(); ++i) {
                    positions.insert(positions.end(), {u - 0.5, v - 0.5, height * std::sin(7 * u) * v});
                    attributes.push_back(static_cast<float>(u) + (i > first || (seam && x > middle) ? 3 : 0));
                    attributes.push_back(static_cast<float>(v));
                    place.push_back(first);
                }
            }
        }
        for (std::uint32_t y = 0; y < cells; ++y) {
            for (std::uint32_t x = 0; x < cells; ++x) {
                const auto &side = x < middle ? left : right;
                const std::uint32_t a = y * (cells + 1) + x;
                const std::uint32_t c = a + cells + 2;
                triangles.insert(triangles.end(), {side[a], side[a + 1], side[c]});
                triangles.insert(triangles.end(), {side[a], side[c], side[c - 1]});
            }
        }
        group.resize(triangles.size() / 3);
    }

    Result run(std::size_t target, double kept = 0.0) const {
        return simplify::simplify({positions, triangles, attributes, weights, -1, place, group},
                                  {target, kept});
    }
};

} // namespace

TEST_CASE("simplify: the least place of a corner is the corner, of a plane the nearest place on it") {
    simplify::Quadric corner;
    corner.add({1, 0, 0}, -2, 1.0);
    corner.add({0, 1, 0}, -3, 0.5);
    corner.add({0, 0, 1}, 4, 2.0);
    mesh::Vec at{0, 0, 0};
    REQUIRE(simplify::least(corner, 1e-6, at));
    CHECK(mesh::length(at - mesh::Vec{2, 3, -4}) < 1e-9);
    CHECK(corner.value(at) == doctest::Approx(0.0));
    simplify::Quadric plane;
    plane.add({0, 0, 1}, -1, 1.0);
    simplify::Quadric seen = plane;
    seen.look_from({5, 6, 7});
    REQUIRE(simplify::least(seen, 1e-6, at));
    CHECK(mesh::length(at - mesh::Vec{0, 0, -6}) < 1e-9);
    CHECK(seen.value({1, 1, 1}) == doctest::Approx(plane.value({6, 7, 8})));
    seen.look_from({-5, -6, -7});
    CHECK(seen.value({1, 2, 3}) == doctest::Approx(plane.value({1, 2, 3})));
    CHECK_FALSE(simplify::least(simplify::Quadric{}, 1e-6, at));
}

TEST_CASE("simplify: a flat sheet becomes few triangles with its image, seam or none") {
    for (const bool seam : {false, true}) {
        const Result found = Sheet(16, 0.0, seam).run(2);
        CHECK(found.triangles.size() / 3 <= (seam ? 4 : 2));
        for (std::size_t i = 0; i < found.vertex.size(); ++i) {
            const double off = found.attributes[2 * i] - (found.positions[3 * i] + 0.5);
            CHECK(std::min(std::fabs(off), std::fabs(off - 3)) < 1e-5);
        }
    }
}

TEST_CASE("simplify: triangles are never more than asked for where nothing holds them") {
    for (const std::size_t target : {300u, 100u, 30u, 10u}) {
        const Result found = Sheet(20, 0.1, true).run(target);
        CHECK(found.stop == Stop::target);
        CHECK(found.triangles.size() / 3 <= target);
        CHECK(found.triangles.size() / 3 + 2 > target);
        CHECK(found.triangle.size() * 3 == found.triangles.size());
        CHECK(found.place.size() * 3 == found.positions.size());
        CHECK(found.place.size() * 2 == found.attributes.size());
    }
}

TEST_CASE("simplify: the area that a part keeps stops it with a reason") {
    const Result card = Sheet(1, 0.0, false).run(0, 0.75);
    CHECK(card.stop == Stop::nothing);
    CHECK(card.triangles.size() == 6);
}

TEST_CASE("simplify: a cost that overflowed to no number is the largest, not an edge outside the queue") {
    const std::uint32_t largest = simplify::Queue::bucket(std::numeric_limits<double>::infinity());
    for (const double none : {std::numeric_limits<double>::quiet_NaN(), -std::nan("")}) {
        CHECK(simplify::Queue::bucket(none) == largest);
        simplify::Queue queue;
        queue.push(7, simplify::Queue::bucket(none));
        std::uint32_t from = 0;
        CHECK(queue.pop(from) == 7);
    }
}

TEST_CASE("simplify: what is degenerate goes, what is no surface is cut and held") {
    // A fin on an inner edge, a triangle turned over, one that is a line.
    Sheet fin(8, 0.0, false);
    fin.triangles.insert(fin.triangles.end(), {40, 41, 0, 41, 40, 2, 3, 3, 4});
    fin.group.resize(fin.triangles.size() / 3);
    const simplify::Surface surface = simplify::build_surface(fin.triangles, fin.place, fin.group);
    CHECK(surface.triangles() == fin.group.size() - 1);
    CHECK(surface.vertices() > fin.place.size());
    const Result found = fin.run(0);
    CHECK(found.triangles.size() >= 9);
    for (const std::uint32_t i : found.triangles) {
        CHECK(i < found.vertex.size());
    }
    CHECK(Sheet(1, 0.0, false).run(0).triangles.size() >= 3);
}
