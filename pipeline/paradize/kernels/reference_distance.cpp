#include "reference_distance.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <thread>
#include <utility>
#include <vector>

#include "triangle_tree.hpp"

namespace paradize::reference {
namespace {

constexpr std::size_t least_samples = 10;
constexpr double sliver = 1e-8; // squared sine below which a foot on the plane is not trusted alone
constexpr std::size_t chunk_size =
    256; // triangles handled together; fixed, so that results do not depend on threads

using Point = TriangleTree::Point;
using Corners = TriangleTree::Corners;

Point minus(const Point &a, const Point &b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Point along(const Point &a, double s, const Point &d) {
    return {a[0] + s * d[0], a[1] + s * d[1], a[2] + s * d[2]};
}
double dot(const Point &a, const Point &b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

Corners corners_of(const Surface &surface, std::size_t triangle) {
    Corners out;
    for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t axis = 0; axis < 3; ++axis)
            out[k][axis] = surface.positions[surface.triangles[triangle * 3 + k] * std::size_t{3} + axis];
    return out;
}

double area_of(const Corners &c) {
    const Point a = minus(c[1], c[0]), b = minus(c[2], c[0]);
    const Point n{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    return 0.5 * std::sqrt(dot(n, n));
}

double to_segment(const Point &p, const Point &a, const Point &b) {
    const Point d = minus(b, a), w = minus(p, a);
    const double l = dot(d, d);
    const double s = l > 0 ? std::clamp(dot(w, d) / l, 0.0, 1.0) : 0;
    const Point r = minus(w, {s * d[0], s * d[1], s * d[2]});
    return dot(r, r);
}

// Squared distance from a point to a triangle: to its plane where the foot falls inside, else to the nearest
// side.
double to_triangle(const Point &p, const Corners &c) {
    const Point a = minus(c[1], c[0]), b = minus(c[2], c[0]), w = minus(p, c[0]);
    const double aa = dot(a, a), ab = dot(a, b), bb = dot(b, b), wa = dot(w, a), wb = dot(w, b);
    const double det = aa * bb - ab * ab;
    const double u = bb * wa - ab * wb, v = aa * wb - ab * wa;
    double best = std::numeric_limits<double>::max();
    if (det > 0 && u >= 0 && v >= 0 && u + v <= det) {
        const Point r = minus(along(along({0, 0, 0}, u / det, a), v / det, b), w);
        best = dot(r, r);
        if (det > sliver * aa * bb)
            return best;
    }
    return std::min({best, to_segment(p, c[0], c[1]), to_segment(p, c[1], c[2]), to_segment(p, c[2], c[0])});
}

// Squared distance to the nearest triangle. `hint`: a triangle to try first, replaced by the nearest one.
double nearest(const TriangleTree &tree, const Point &p, std::uint32_t &hint,
               std::vector<std::uint32_t> &room) {
    double best = to_triangle(p, tree.corners(hint));
    tree.search(p, best, room, [&](std::uint32_t triangle) {
        const double d = to_triangle(p, tree.corners(triangle));
        if (d < best) {
            best = d;
            hint = triangle;
        }
    });
    return best;
}

// The k-th point of a two-dimensional low-discrepancy sequence, folded into a triangle.
// Source: M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018.
Point sample(const Corners &c, std::size_t k) {
    constexpr double g1 = 0.7548776662466927, g2 = 0.5698402909980532;
    const double n = static_cast<double>(k) + 0.5;
    double u = n * g1 - std::floor(n * g1), v = n * g2 - std::floor(n * g2);
    if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
    }
    return along(along(c[0], u, minus(c[1], c[0])), v, minus(c[2], c[0]));
}

struct Measured {
    double distance, area;
};

} // namespace

Distance one_sided(const Surface &from, const Surface &to, std::uint64_t samples, unsigned threads) {
    const TriangleTree tree(to.positions, to.triangles);
    const std::size_t count = from.triangles.size() / 3;
    double total = 0;
    for (std::size_t i = 0; i < count; ++i)
        total += area_of(corners_of(from, i));
    std::vector<std::uint32_t> looked_at(from.positions.size() / 3,
                                         0xffffffffu); // triangle that looks at a vertex
    for (std::size_t i = from.triangles.size(); i-- > 0;)
        looked_at[from.triangles[i]] = static_cast<std::uint32_t>(i / 3);
    const std::size_t chunks = (count + chunk_size - 1) / chunk_size;
    std::vector<std::vector<Measured>> measured(chunks);
    std::vector<double> largest(chunks, 0);
    std::atomic<std::size_t> next{0};
    const auto work = [&] {
        for (std::size_t chunk = next++; chunk < chunks; chunk = next++) {
            std::uint32_t hint = 0;
            std::vector<std::uint32_t> room;
            for (std::size_t i = chunk * chunk_size; i < std::min(count, (chunk + 1) * chunk_size); ++i) {
                const Corners c = corners_of(from, i);
                const double area = area_of(c);
                const double share = total > 0 ? area / total * static_cast<double>(samples) : 0;
                const std::size_t n = std::max(least_samples, static_cast<std::size_t>(std::ceil(share)));
                for (std::size_t k = 0; k < n; ++k)
                    measured[chunk].push_back(
                        {nearest(tree, sample(c, k), hint, room), area / static_cast<double>(n)});
                for (std::size_t k = 0; k < 3; ++k) {
                    const Point middle = along(c[k], 0.5, minus(c[(k + 1) % 3], c[k]));
                    largest[chunk] = std::max(largest[chunk], nearest(tree, middle, hint, room));
                    if (looked_at[from.triangles[i * 3 + k]] == i)
                        largest[chunk] = std::max(largest[chunk], nearest(tree, c[k], hint, room));
                }
            }
        }
    };
    std::vector<std::jthread> others;
    for (unsigned t = 1; t < threads && t < chunks; ++t)
        others.emplace_back(work);
    work();
    others.clear();

    Distance out;
    std::vector<Measured> all;
    for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
        out.max = std::max(out.max, largest[chunk]);
        all.insert(all.end(), measured[chunk].begin(), measured[chunk].end());
    }
    double squares = 0, area = 0;
    for (const Measured &m : all) {
        squares += m.distance * m.area;
        area += m.area;
        out.max = std::max(out.max, m.distance);
    }
    out.max = std::sqrt(out.max);
    out.rms = area > 0 ? std::sqrt(squares / area) : out.max;
    std::ranges::sort(all, [](const Measured &a, const Measured &b) {
        return std::pair(a.distance, a.area) < std::pair(b.distance, b.area);
    });
    double below = 0;
    for (const Measured &m : all) {
        out.p99 = std::sqrt(m.distance);
        below += m.area;
        if (below >= 0.99 * area)
            break;
    }
    return out;
}

} // namespace paradize::reference
