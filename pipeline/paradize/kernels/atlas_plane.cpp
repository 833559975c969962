#include "atlas_plane.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace paradize::atlas {

namespace {

// A chart is cut where a triangle of more than this share of it becomes longer or shorter by more than this,
// or where the squares of what lengths are off exceed this in the mean.
constexpr double own_say = 1e-5;
constexpr double most_stretch = 2.5;
constexpr double most_energy = 0.02;

// Edges of one triangle only.
std::vector<std::array<std::uint32_t, 2>> border(std::span<const Triangle> triangles) {
    std::vector<std::array<std::uint32_t, 3>> edges; // low, high, turned
    for (const Triangle &t : triangles) {
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t i = t.corner[k], j = t.corner[(k + 1) % 3];
            edges.push_back({std::min(i, j), std::max(i, j), i > j ? 1U : 0U});
        }
    }
    std::ranges::sort(edges);
    std::vector<std::array<std::uint32_t, 2>> found;
    for (std::size_t i = 0; i < edges.size();) {
        std::size_t end = i + 1;
        while (end < edges.size() && edges[end][0] == edges[i][0] && edges[end][1] == edges[i][1]) {
            ++end;
        }
        if (end - i == 1) {
            found.push_back({edges[i][0], edges[i][1]});
        }
        i = end;
    }
    return found;
}

bool cross_each_other(std::span<const Vec> places, const std::array<std::uint32_t, 2> &e,
                      const std::array<std::uint32_t, 2> &f) {
    if (e[0] == f[0] || e[0] == f[1] || e[1] == f[0] || e[1] == f[1]) {
        return false;
    }
    const Vec a = places[e[0]], b = places[e[1]], c = places[f[0]], d = places[f[1]];
    const double x = cross(b - a, c - a), y = cross(b - a, d - a);
    const double z = cross(d - c, a - c), w = cross(d - c, b - c);
    return ((x > 0) != (y > 0)) && ((z > 0) != (w > 0));
}

} // namespace

bool too_stretched(std::span<const Triangle> triangles, double area2, std::span<const Vec> places) {
    const auto at = [&](const Triangle &t, std::size_t k) { return places[t.corner[k]]; };
    double sum = 0, area = 0;
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
        if (t.area2 > own_say * area2 && (most > most_stretch || least * most_stretch < 1)) {
            return true;
        }
        sum += t.area2 * ((most - 1) * (most - 1) + (least - 1) * (least - 1));
        area += t.area2;
    }
    return sum > most_energy * area;
}

bool border_crosses(std::span<const Triangle> triangles, std::span<const Vec> places) {
    const auto edges = border(triangles);
    if (edges.empty()) {
        return true; // a closed surface has no place in a plane
    }
    Vec low{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()},
        high{-low.x, -low.y};
    for (const Vec &p : places) {
        low = {std::min(low.x, p.x), std::min(low.y, p.y)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
    const auto cells =
        static_cast<std::size_t>(std::clamp(std::sqrt(static_cast<double>(edges.size())), 1.0, 512.0));
    const double size = std::max(high.x - low.x, high.y - low.y);
    if (!(size > 0)) {
        return false; // no triangle has an area: nothing to cover twice
    }
    const auto cell = [&](double value) {
        return static_cast<std::size_t>(
            std::clamp(value / size * static_cast<double>(cells), 0.0, static_cast<double>(cells) - 1));
    };
    std::vector<std::vector<std::uint32_t>> grid(cells * cells);
    for (std::uint32_t e = 0; e < edges.size(); ++e) {
        const Vec a = places[edges[e][0]], b = places[edges[e][1]];
        for (std::size_t y = cell(std::min(a.y, b.y) - low.y); y <= cell(std::max(a.y, b.y) - low.y); ++y) {
            for (std::size_t x = cell(std::min(a.x, b.x) - low.x); x <= cell(std::max(a.x, b.x) - low.x);
                 ++x) {
                for (const std::uint32_t other : grid[y * cells + x]) {
                    if (cross_each_other(places, edges[e], edges[other])) {
                        return true;
                    }
                }
                grid[y * cells + x].push_back(e);
            }
        }
    }
    return false;
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
