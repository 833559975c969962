// The triangles of a surface in a tree of oriented boxes, to find the nearest one to a point. Header only.
// Boxes turn with what they hold, or bundles of long thin triangles would fill one another's boxes.
// Source: S. Gottschalk, M. Lin and D. Manocha, "OBBTree: a hierarchical structure for rapid interference
// detection", 1996.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

namespace paradize {

class TriangleTree {
  public:
    using Point = std::array<double, 3>;
    using Corners = std::array<Point, 3>;

    // positions: (n, 3) finite; triangles: (m, 3), m > 0.
    TriangleTree(std::span<const float> positions, std::span<const std::uint32_t> triangles)
        : corners_(triangles.size() / 3), order_(corners_.size()) {
        for (std::size_t i = 0; i < triangles.size(); ++i)
            for (std::size_t axis = 0; axis < 3; ++axis)
                corners_[i / 3][i % 3][axis] = positions[triangles[i] * std::size_t{3} + axis];
        std::iota(order_.begin(), order_.end(), 0u);
        nodes_.reserve(corners_.size());
        build(0, order_.size());
    }

    const Corners &corners(std::size_t triangle) const { return corners_[triangle]; }

    // Calls `test(triangle)` for every triangle that may be nearer to p than `best` (squared distance), the
    // nearest boxes first; `test` lowers `best` where a triangle is nearer. `open` is room to work in.
    template <typename Test>
    void search(const Point &p, double &best, std::vector<std::uint32_t> &open, Test test) const {
        open.assign(1, 0);
        while (!open.empty()) {
            const std::uint32_t at = open.back();
            open.pop_back();
            const Node &node = nodes_[at];
            if (node.distance(p) > best)
                continue;
            if (node.right == 0) {
                for (std::size_t i = node.first; i < node.stop; ++i)
                    test(order_[i]);
                continue;
            }
            const bool left_first = nodes_[at + 1].distance(p) < nodes_[node.right].distance(p);
            open.push_back(left_first ? node.right : at + 1);
            open.push_back(left_first ? at + 1 : node.right);
        }
    }

  private:
    using Axes = std::array<Point, 3>;
    static constexpr std::size_t leaf_size = 4;

    struct Node {
        Axes axes;
        Point centre, half;               // in the frame of the axes
        std::uint32_t first, stop, right; // right == 0: a leaf; the left child follows its parent
        double distance(const Point &p) const {
            double sum = 0;
            for (std::size_t k = 0; k < 3; ++k) {
                const double along = axes[k][0] * p[0] + axes[k][1] * p[1] + axes[k][2] * p[2];
                const double d = std::fabs(along - centre[k]) - half[k];
                sum += d > 0 ? d * d : 0;
            }
            return sum;
        }
    };

    // The directions in which the corners of some triangles spread: eigenvectors of their covariance, by
    // Jacobi's rotations (1846).
    Axes spread(std::size_t first, std::size_t stop) const {
        const Point origin = corners_[order_[first]][0];
        double size = 0;
        for (std::size_t i = first; i < stop; ++i)
            for (const Point &p : corners_[order_[i]])
                for (std::size_t k = 0; k < 3; ++k)
                    size = std::max(size, std::fabs(p[k] - origin[k]));
        Axes axes{Point{1, 0, 0}, Point{0, 1, 0}, Point{0, 0, 1}};
        if (!(size > 0))
            return axes;
        Point mean{};
        std::array<Point, 3> m{};
        for (std::size_t i = first; i < stop; ++i)
            for (const Point &p : corners_[order_[i]]) {
                const Point d{(p[0] - origin[0]) / size, (p[1] - origin[1]) / size,
                              (p[2] - origin[2]) / size};
                for (std::size_t k = 0; k < 3; ++k) {
                    mean[k] += d[k];
                    for (std::size_t l = k; l < 3; ++l)
                        m[k][l] += d[k] * d[l];
                }
            }
        const double count = 3.0 * static_cast<double>(stop - first);
        for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t l = k; l < 3; ++l)
                m[l][k] = m[k][l] -= mean[k] * mean[l] / count;
        for (int sweep = 0; sweep < 12; ++sweep)
            for (const auto &[p, q] : {std::pair<std::size_t, std::size_t>{0, 1}, {0, 2}, {1, 2}}) {
                if (m[p][q] == 0)
                    continue;
                const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
                const double t = (theta >= 0 ? 1 : -1) / (std::fabs(theta) + std::sqrt(theta * theta + 1));
                if (!std::isfinite(t))
                    continue;
                const double c = 1 / std::sqrt(t * t + 1), s = t * c;
                for (std::size_t k = 0; k < 3; ++k) {
                    const double a = m[k][p], b = m[k][q];
                    m[k][p] = c * a - s * b;
                    m[k][q] = s * a + c * b;
                }
                for (std::size_t k = 0; k < 3; ++k) {
                    const double a = m[p][k], b = m[q][k];
                    m[p][k] = c * a - s * b;
                    m[q][k] = s * a + c * b;
                    const double u = axes[p][k], v = axes[q][k];
                    axes[p][k] = c * u - s * v;
                    axes[q][k] = s * u + c * v;
                }
            }
        return axes;
    }

    Node box(std::size_t first, std::size_t stop, const Axes &axes) const {
        Node node{axes, {}, {}, static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(stop), 0};
        for (std::size_t k = 0; k < 3; ++k) {
            double low = std::numeric_limits<double>::max(), high = std::numeric_limits<double>::lowest();
            for (std::size_t i = first; i < stop; ++i)
                for (const Point &p : corners_[order_[i]]) {
                    const double along = axes[k][0] * p[0] + axes[k][1] * p[1] + axes[k][2] * p[2];
                    low = std::min(low, along);
                    high = std::max(high, along);
                }
            node.centre[k] = 0.5 * low + 0.5 * high;
            // A little wider than it must be: rounding never hides a triangle.
            node.half[k] = (0.5 * high - 0.5 * low) + 1e-14 * std::max(std::fabs(low), std::fabs(high));
        }
        return node;
    }

    static double surface(const Node &node) {
        return node.half[0] * node.half[1] + node.half[1] * node.half[2] + node.half[2] * node.half[0];
    }

    std::uint32_t build(std::size_t first, std::size_t stop) {
        const auto number = static_cast<std::uint32_t>(nodes_.size());
        const Node upright = box(first, stop, {Point{1, 0, 0}, Point{0, 1, 0}, Point{0, 0, 1}});
        const Node turned = box(first, stop, spread(first, stop));
        nodes_.push_back(surface(turned) < 0.7 * surface(upright) ? turned : upright);
        if (stop - first <= leaf_size)
            return number;
        const Axes axes = nodes_[number].axes;
        const auto middle = [&](std::uint32_t triangle, std::size_t k) {
            double sum = 0;
            for (const Point &p : corners_[triangle])
                sum += axes[k][0] * p[0] + axes[k][1] * p[1] + axes[k][2] * p[2];
            return sum;
        };
        std::size_t widest = 0;
        double extent = -1;
        for (std::size_t k = 0; k < 3; ++k) {
            double low = std::numeric_limits<double>::max(), high = std::numeric_limits<double>::lowest();
            for (std::size_t i = first; i < stop; ++i) {
                low = std::min(low, middle(order_[i], k));
                high = std::max(high, middle(order_[i], k));
            }
            if (high - low > extent) {
                extent = high - low;
                widest = k;
            }
        }
        const std::size_t half = first + (stop - first) / 2;
        const auto at = [&](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
        std::nth_element(at(first), at(half), at(stop), [&](std::uint32_t a, std::uint32_t b) {
            return std::pair(middle(a, widest), a) < std::pair(middle(b, widest), b);
        });
        build(first, half);
        const std::uint32_t right = build(half, stop);
        nodes_[number].right = right;
        return number;
    }

    std::vector<Corners> corners_;
    std::vector<std::uint32_t> order_;
    std::vector<Node> nodes_;
};

} // namespace paradize
