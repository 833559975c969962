// Boxes of texture coordinates beside a tree's boxes of positions: finds the place of a surface that is near
// a point and shows nearly the same texel, without a visit to all triangles near the point. For metrics only.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "reference/tree.hpp"

namespace paradize::reference {

using Uv = std::array<double, 2>;

class UvTree {
  public:
    // triangles: (m, 3), those of the tree with vertices of their own; uvs: (n, 2), finite. `tree` must
    // outlive this.
    UvTree(const Tree &tree, std::span<const std::uint32_t> triangles, std::span<const float> uvs);

    // A part of the tree that is still to be looked at, and the least that a place in it costs.
    struct Entry {
        double cost;
        std::uint64_t child;
    };

    // Calls test(corners, uvs) with triangles, the cheapest boxes first, until no other can cost less than
    // `best`; `test` lowers `best`. A place costs its distance from p plus `unit` times its distance from uv
    // in texture coordinates. open: memory, reused between calls.
    template <typename Test>
    void search(const Point &p, const Uv &uv, double unit, double &best, std::vector<Entry> &open,
                Test test) const {
        const auto cheaper = [](const Entry &a, const Entry &b) { return a.cost > b.cost; };
        open.assign(1, {0, 0});
        while (!open.empty() && open.front().cost <= best) {
            const std::uint64_t child = open.front().child;
            std::pop_heap(open.begin(), open.end(), cheaper);
            open.pop_back();
            if (child & Tree::leaf_bit) {
                const std::size_t first = (child & ~Tree::leaf_bit) >> 3, count = child & 7;
                for (std::size_t slot = first; slot < first + count; ++slot)
                    test(tree_.corners(slot), corners_[slot]);
                continue;
            }
            const Tree::Node &node = tree_.nodes()[child];
            const Boxes &boxes = boxes_[child];
            for (std::size_t k = 0; k < 4; ++k) {
                if (node.child[k] == Tree::empty)
                    continue;
                double off = 0, miss = 0;
                for (std::size_t axis = 0; axis < 3; ++axis)
                    off += outside(p[axis], node.low[axis][k], node.high[axis][k]);
                for (std::size_t axis = 0; axis < 2; ++axis)
                    miss += outside(uv[axis], boxes.low[axis][k], boxes.high[axis][k]);
                const double cost = (std::sqrt(off) + unit * std::sqrt(miss)) * rounding;
                if (cost > best)
                    continue;
                open.push_back({cost, node.child[k]});
                std::push_heap(open.begin(), open.end(), cheaper);
            }
        }
    }

  private:
    // No triangle is left out because its box's cost is rounded up.
    static constexpr double rounding = 1 - 1e-12;

    struct Boxes {
        double low[2][4], high[2][4];
    };

    static double outside(double x, double low, double high) {
        const double off = std::max({low - x, x - high, 0.0});
        return off * off;
    }

    const Tree &tree_;
    std::vector<std::array<Uv, 3>> corners_; // by slot
    std::vector<Boxes> boxes_;               // by node
};

} // namespace paradize::reference
