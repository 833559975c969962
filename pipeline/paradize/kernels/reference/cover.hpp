// The part of a flat convex piece that lies near one triangle, and the parts that may not. For metrics only.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "reference/tree.hpp"

namespace paradize::reference {

// A triangle that places are measured against.
class Target {
  public:
    explicit Target(const Corners &corners);

    // Squared distance to a point of the triangle, the nearest but for rounding: never too small.
    double squared(const Point &p) const;

    // Of a segment from a, which is no farther than `enough` from the triangle, to b, which is: the share of
    // the way up to which no point is farther, or somewhat less. from, to: how far a and b are.
    double within(const Point &a, const Point &b, double from, double to, double enough) const;

  private:
    double distance(const Point &p) const;

    Corners at_;
    Point u_, v_, normal_;
    double long_side_ = 0, area_ = 0; // squared: the longer of both sides, the normal's length
    bool needle_ = false;
};

// A flat convex part of a triangle, its corners in order.
struct Polygon {
    static constexpr std::size_t most = 8;
    std::size_t count = 0;
    std::array<Point, most> at;

    void add(const Point &p) { at[count++] = p; }
};

Point middle(const Polygon &polygon);

// Both parts of a polygon, cut from the middle of its longest side.
std::array<Polygon, 2> halves(const Polygon &polygon);

// The rest of a polygon after the part near a triangle is clipped away.
struct ClippedPolygon {
    double near = 0;       // no point of what was taken away lies farther from the triangle
    double farthest = 0;   // no point of the whole polygon does
    bool worth = true;     // enough was taken away; if not, there are no parts
    std::size_t count = 0; // 0 and worth: all of it is near
    std::array<Polygon, Polygon::most / 2> parts;
};

// By convexity no point of a polygon is farther from a triangle than its farthest corner. Sides that lead
// farther away than `enough` are cut there, and each run of corners beyond is a part of its own.
ClippedPolygon beyond(const Polygon &polygon, const Target &target, double enough);

} // namespace paradize::reference
