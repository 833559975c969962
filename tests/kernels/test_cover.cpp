// Which part of a flat piece lies near a triangle: what is left covers the rest, and nothing is lost.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

#include "reference/cover.hpp"

using namespace paradize::reference;

namespace {

// Twice its area, of a polygon in the ground plane: corners that turn the same way count the same sign.
double doubled(const Polygon &polygon) {
    double sum = 0;
    for (std::size_t k = 2; k < polygon.count; ++k)
        sum += cross(minus(polygon.at[k - 1], polygon.at[0]), minus(polygon.at[k], polygon.at[0]))[1];
    return sum;
}

bool holds(const Polygon &polygon, const Point &p) {
    const double turn = doubled(polygon) < 0 ? -1 : 1;
    for (std::size_t k = 0; k < polygon.count; ++k) {
        const Point &a = polygon.at[k], &b = polygon.at[(k + 1) % polygon.count];
        if (turn * cross(minus(b, a), minus(p, a))[1] < -1e-9)
            return false;
    }
    return true;
}

// Three to eight places on a circle, in order: convex. Every fourth is as thin as a needle.
Polygon convex(std::mt19937 &random) {
    std::uniform_real_distribution<double> angle(0, 6.28318);
    std::array<double, Polygon::most> angles;
    Polygon out;
    const std::size_t count = 3 + random() % (Polygon::most - 2);
    for (double &value : angles)
        value = angle(random);
    std::sort(angles.begin(), angles.begin() + static_cast<std::ptrdiff_t>(count));
    const double wide = random() % 4 ? 1 : 1e-4;
    for (std::size_t k = 0; k < count; ++k)
        out.add({std::cos(angles[k]), 0, wide * std::sin(angles[k])});
    return out;
}

} // namespace

TEST_CASE("whatLiesBeyondATriangleIsInOneOfTheParts") {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> any(-1.2, 1.2), share(0, 1);
    int cut = 0, parted = 0;
    for (int round = 0; round < 4000; ++round) {
        const Polygon polygon = convex(random);
        Corners corners;
        for (Point &corner : corners)
            corner = {any(random), 0.2 * any(random), any(random)};
        if (round % 5 == 0)
            corners[2] = corners[1]; // a line
        if (round % 25 == 0)
            corners[1] = corners[2] = corners[0]; // a point
        const Target target(corners);
        const double enough = 0.02 + 0.6 * share(random);
        const ClippedPolygon rest = beyond(polygon, target, enough);
        CHECK(rest.near <= enough);
        if (!rest.worth) {
            CHECK(rest.count == 0);
            continue;
        }
        cut += rest.count > 0;
        parted += rest.count > 1;
        double left = 0;
        for (std::size_t i = 0; i < rest.count; ++i)
            left += doubled(rest.parts[i]);
        CHECK(std::abs(left) < std::abs(doubled(polygon)));
        for (int sample = 0; sample < 40; ++sample) {
            Point p{};
            double whole = 0;
            for (std::size_t k = 0; k < polygon.count; ++k) {
                const double weight = -std::log(1 - share(random));
                p = along(p, weight, polygon.at[k]);
                whole += weight;
            }
            p = along({}, 1 / whole, p);
            const double off = std::sqrt(target.squared(p));
            CHECK(off <= rest.farthest + 1e-9);
            int within = 0;
            for (std::size_t i = 0; i < rest.count; ++i)
                within += holds(rest.parts[i], p);
            if (within == 0)
                CHECK(off <= rest.near + 1e-9);
        }
    }
    CHECK(cut > 500);
    CHECK(parted > 20);
}

TEST_CASE("aLineIsNeverWorthCutting") {
    // Without an area no share of it tells how much was taken away.
    Polygon line;
    for (const double x : {0.0, 1.0, 0.3, 0.6})
        line.add({x, 0, x});
    const Target target({Point{0, 0, 0}, Point{0.5, 0, 0}, Point{0, 0, 0.5}});
    CHECK(!beyond(line, target, 0.1).worth);
}

TEST_CASE("halvesAreTheWhole") {
    std::mt19937 random(7);
    for (int round = 0; round < 500; ++round) {
        const Polygon polygon = convex(random);
        const auto parts = halves(polygon);
        CHECK(doubled(parts[0]) + doubled(parts[1]) == doctest::Approx(doubled(polygon)));
        CHECK(parts[0].count + parts[1].count == polygon.count + 3);
        for (const Polygon &part : parts) {
            CHECK(part.count < polygon.count + 1);
            for (std::size_t k = 0; k < part.count; ++k)
                CHECK(holds(polygon, part.at[k]));
        }
    }
}
