#include "atlas/plane.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace paradize::atlas {

namespace {

// A triangle of less than this share of a chart has no say of its own in how far it is stretched.
constexpr double own_say = 1e-5;
constexpr double most_side_stretch = 2.5;

} // namespace

Stretch stretch_of(std::span<const Triangle> triangles, double area2, std::span<const Vec> places) {
    Stretch out;
    const auto at = [&](const Triangle &t, std::size_t k) { return places[t.corner[k]]; };
    double sum = 0;
    for (const Triangle &t : triangles) {
        if (!(t.area2 > 0)) {
            continue;
        }
        const Vec along = at(t, 1) - at(t, 0), other = at(t, 2) - at(t, 0);
        const double side = t.rest[1].x, shift = t.rest[2].x, tall = t.rest[2].y;
        const double a = along.x / side, c = along.y / side;
        const double b = (other.x - a * shift) / tall, d = (other.y - c * shift) / tall;
        const double turn = std::sqrt((a + d) * (a + d) + (c - b) * (c - b)) / 2;
        const double shear = std::sqrt((a - d) * (a - d) + (c + b) * (c + b)) / 2;
        const double most = turn + shear, least = std::abs(turn - shear);
        out.torn |= t.area2 > own_say * area2 && (most > most_side_stretch || least * most_side_stretch < 1);
        sum += t.area2 * ((most - 1) * (most - 1) + (least - 1) * (least - 1));
    }
    out.mean = area2 > 0 ? sum / area2 : 0;
    return out;
}

void turn_upright(std::vector<Vec> &places) {
    std::vector<Vec> points = places, hull;
    std::ranges::sort(points, [](Vec a, Vec b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
    for (int pass = 0; pass < 2; ++pass) {
        const std::size_t base = hull.size();
        for (const Vec &p : points) {
            while (hull.size() >= base + 2 &&
                   cross(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0) {
                hull.pop_back();
            }
            hull.push_back(p);
        }
        hull.pop_back();
        std::ranges::reverse(points);
    }
    double best = std::numeric_limits<double>::infinity();
    Vec axis{1, 0};
    for (std::size_t i = 0; i < hull.size(); ++i) {
        const Vec side = hull[(i + 1) % hull.size()] - hull[i];
        const double length = std::sqrt(side.x * side.x + side.y * side.y);
        if (!(length > 0)) {
            continue;
        }
        Vec along{side.x / length, side.y / length};
        double x0 = 0, x1 = 0, y1 = 0;
        for (const Vec &p : hull) {
            const Vec d = p - hull[i];
            const double x = d.x * along.x + d.y * along.y, y = cross(along, d);
            x0 = std::min(x0, x);
            x1 = std::max(x1, x);
            y1 = std::max(y1, y);
        }
        if ((x1 - x0) * y1 < best) {
            best = (x1 - x0) * y1;
            axis = x1 - x0 >= y1 ? along : Vec{-along.y, along.x};
        }
    }
    for (Vec &p : places) {
        p = {p.x * axis.x + p.y * axis.y, cross(axis, p)};
    }
}

} // namespace paradize::atlas
