// A chart in the plane, and what is asked of it there.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace paradize::atlas {

struct Vec {
    double x = 0, y = 0;
};
inline Vec operator-(Vec a, Vec b) {
    return {a.x - b.x, a.y - b.y};
}
inline double cross(Vec a, Vec b) {
    return a.x * b.y - a.y * b.x;
}

struct Triangle {
    std::array<std::uint32_t, 3> corner{}; // numbers within the chart
    std::array<Vec, 3> rest{};             // its own shape in the plane
    std::array<double, 3> weight{};        // of the edge from corner k to k + 1: half the opposite cotangent
    double area2 = 0;                      // twice its area
    double stiff = 0;                      // the same, or more where it is a sliver
};

// How far the two lengths that a unit in the surface has in the plane are from 1.
struct Stretch {
    double mean = 0;   // of the squares, over the surface
    bool torn = false; // whether a triangle is stretched or pressed beyond measure
};
// area2: of all triangles; places: in the plane.
Stretch stretch_of(std::span<const Triangle> triangles, double area2, std::span<const Vec> places);

// Turns the chart so that a side of its convex hull is level and the rectangle around it is the smallest.
void turn_upright(std::vector<Vec> &places);

} // namespace paradize::atlas
