#include "mesh/project.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "math/vec.hpp"
#include "mesh/triangle_tree.hpp"
#include "unify.hpp"

namespace paradize::mesh {
namespace {

constexpr double inset = 0.05;  // of the way from a corner to its triangle's middle
constexpr double facing = 0.25; // least cosine between normals of triangles that face the same way

struct Hit {
    std::uint32_t triangle = 0xffffffffu;
    double distance = std::numeric_limits<double>::max(); // squared
};

struct ClosestPoint {
    std::array<double, 3> weights;
    double distance; // squared
};

// The nearest point of a triangle. Source: C. Ericson, "Real-Time Collision Detection", 2004, section 5.1.5.
ClosestPoint nearest_point(Vec p, Vec a, Vec b, Vec c) {
    const Vec ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
    const double d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp), d5 = dot(ab, cp),
                 d6 = dot(ac, cp);
    const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
    std::array<double, 3> w;
    if (d1 <= 0 && d2 <= 0)
        w = {1, 0, 0};
    else if (d3 >= 0 && d4 <= d3)
        w = {0, 1, 0};
    else if (d6 >= 0 && d5 <= d6)
        w = {0, 0, 1};
    else if (vc <= 0 && d1 >= 0 && d3 <= 0)
        w = {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
    else if (vb <= 0 && d2 >= 0 && d6 <= 0)
        w = {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
    else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
        w = {0, 1 - (d4 - d3) / ((d4 - d3) + (d5 - d6)), (d4 - d3) / ((d4 - d3) + (d5 - d6))};
    else
        w = {va / (va + vb + vc), vb / (va + vb + vc), vc / (va + vb + vc)};
    for (double &x : w) // 0 / 0 on a triangle without area
        x = std::isfinite(x) ? std::clamp(x, 0.0, 1.0) : 0;
    const double sum = w[0] + w[1] + w[2];
    w = sum > 0 ? std::array<double, 3>{w[0] / sum, w[1] / sum, w[2] / sum} : std::array<double, 3>{1, 0, 0};
    const Vec r = w[0] * a + w[1] * b + w[2] * c - p;
    return {w, dot(r, r)};
}

// The original surface, to be asked for the triangle nearest to a point.
class Original {
  public:
    Original(std::span<const float> positions, std::span<const std::uint32_t> triangles)
        : tree_(positions, triangles), normals_(triangles.size() / 3) {
        for (std::size_t i = 0; i < normals_.size(); ++i)
            normals_[i] = unit(cross(corner(i, 1) - corner(i, 0), corner(i, 2) - corner(i, 0)));
    }

    ClosestPoint foot(std::size_t triangle, Vec p) const {
        return nearest_point(p, corner(triangle, 0), corner(triangle, 1), corner(triangle, 2));
    }

    // The nearest triangle that faces along `normal` (any, where `normal` is zero); of equally near ones the
    // first.
    Hit nearest(Vec p, Vec normal) {
        Hit best;
        const bool any = normal == Vec{};
        tree_.search({p.x, p.y, p.z}, best.distance, room_, [&](std::uint32_t t) {
            if (!any && dot(normals_[t], normal) < facing)
                return;
            const double d = foot(t, p).distance;
            if (d < best.distance || (d == best.distance && t < best.triangle))
                best = {t, d};
        });
        return best;
    }

    // The nearest triangle of the chart that the triangle `from` belongs to.
    std::uint32_t nearest_of_chart(Vec p, std::uint32_t from, std::span<const std::uint32_t> charts) {
        Hit best{from, foot(from, p).distance};
        tree_.search({p.x, p.y, p.z}, best.distance, room_, [&](std::uint32_t t) {
            if (charts[t] != charts[from])
                return;
            const double d = foot(t, p).distance;
            if (d < best.distance || (d == best.distance && t < best.triangle))
                best = {t, d};
        });
        return best.triangle;
    }

  private:
    Vec corner(std::size_t triangle, std::size_t k) const {
        const auto &c = tree_.corners(triangle)[k];
        return {c[0], c[1], c[2]};
    }

    TriangleTree tree_;
    std::vector<Vec> normals_;
    std::vector<std::uint32_t> room_;
};

} // namespace

Places project(std::span<const float> source_positions, std::span<const std::uint32_t> source_triangles,
               std::span<const std::uint32_t> charts, std::span<const float> positions,
               std::span<const std::uint32_t> triangles, bool one_chart) {
    Original original(source_positions, source_triangles);
    std::vector<std::uint32_t> found(triangles.size());
    for (std::size_t t = 0; t < triangles.size() / 3; ++t) {
        const Vec a = at3(positions, triangles[t * 3]), b = at3(positions, triangles[t * 3 + 1]),
                  c = at3(positions, triangles[t * 3 + 2]);
        const Vec normal = unit(cross(b - a, c - a));
        const Vec middle = (1.0 / 3) * (a + b + c);
        if (one_chart) {
            Hit under = original.nearest(middle, normal);
            if (under.triangle == 0xffffffffu)
                under = original.nearest(middle, {});
            for (std::size_t k = 0; k < 3; ++k)
                found[t * 3 + k] =
                    original.nearest_of_chart(at3(positions, triangles[t * 3 + k]), under.triangle, charts);
            continue;
        }
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec p = at3(positions, triangles[t * 3 + k]);
            const Vec inside = p + inset * (middle - p);
            Hit hit = original.nearest(inside, normal);
            if (hit.triangle == 0xffffffffu)
                hit = original.nearest(inside, {});
            found[t * 3 + k] = hit.triangle;
        }
    }
    const Numbered shared = number_equal(
        triangles.size(), [&](std::size_t i) { return mix(mix(hash_seed, triangles[i]), charts[found[i]]); },
        [&](std::size_t i, std::size_t j) {
            return triangles[i] == triangles[j] && charts[found[i]] == charts[found[j]];
        });
    Places out;
    out.triangle.resize(triangles.size());
    out.weights.resize(triangles.size() * 3);
    std::vector<Hit> best(shared.first.size());
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const double d = original.foot(found[i], at3(positions, triangles[i])).distance;
        Hit &here = best[shared.index[i]];
        if (d < here.distance || (d == here.distance && found[i] < here.triangle))
            here = {found[i], d};
    }
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const std::uint32_t t = best[shared.index[i]].triangle;
        const ClosestPoint foot = original.foot(t, at3(positions, triangles[i]));
        out.triangle[i] = t;
        std::copy(foot.weights.begin(), foot.weights.end(), &out.weights[i * 3]);
    }
    return out;
}

} // namespace paradize::mesh
