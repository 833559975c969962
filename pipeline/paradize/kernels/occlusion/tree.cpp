#include "occlusion/tree.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace paradize::occlusion {
namespace {

constexpr std::size_t bins = 16;
constexpr std::size_t leaf_size = 4;  // triangles that are never split
constexpr std::size_t sah_depth = 48; // below: halves, so that the tree ends
constexpr float visit_cost = 1.0F;    // of a box, where a triangle costs 1
constexpr float infinity = std::numeric_limits<float>::infinity();

using Position = std::array<float, 3>;

struct Box {
    Position low{infinity, infinity, infinity}, high{-infinity, -infinity, -infinity};
    void add(const Position &p) {
        for (std::size_t k = 0; k < 3; ++k) {
            low[k] = std::min(low[k], p[k]);
            high[k] = std::max(high[k], p[k]);
        }
    }
    void add(const Box &other) {
        for (std::size_t k = 0; k < 3; ++k) {
            low[k] = std::min(low[k], other.low[k]);
            high[k] = std::max(high[k], other.high[k]);
        }
    }
    float surface() const {
        const float x = high[0] - low[0], y = high[1] - low[1], z = high[2] - low[2];
        return x < 0 ? 0.0F : x * y + y * z + z * x;
    }
};

struct Item {
    Box box;
    Position middle;
    std::array<float, 9> corners;
};

class Builder {
  public:
    Builder(std::vector<Item> items, Tree &tree) : items_(std::move(items)), tree_(tree) {
        tree_.nodes.reserve(items_.size());
        tree_.corners.reserve(items_.size());
        if (!items_.empty()) {
            build(0, items_.size(), 0);
        }
    }

  private:
    std::uint32_t build(std::size_t first, std::size_t stop, std::size_t depth) {
        Box box, middles;
        for (std::size_t i = first; i < stop; ++i) {
            box.add(items_[i].box);
            middles.add(items_[i].middle);
        }
        const auto number = static_cast<std::uint32_t>(tree_.nodes.size());
        tree_.nodes.push_back({box.low, box.high, 0, 0, 0, 0});
        std::size_t axis = 0;
        for (std::size_t k = 1; k < 3; ++k) {
            if (middles.high[k] - middles.low[k] > middles.high[axis] - middles.low[axis]) {
                axis = k;
            }
        }
        std::size_t split = stop;
        if (stop - first > leaf_size) {
            split = depth < sah_depth ? best_split(first, stop, box, middles, axis) : first;
            if (split == first || split == stop) {
                split = halves(first, stop, axis);
            }
        }
        if (split == stop) {
            Node &leaf = tree_.nodes[number];
            leaf.first = static_cast<std::uint32_t>(tree_.corners.size());
            leaf.count = static_cast<std::uint32_t>(stop - first);
            for (std::size_t i = first; i < stop; ++i) {
                tree_.corners.push_back(items_[i].corners);
            }
            return number;
        }
        tree_.nodes[number].axis = static_cast<std::uint32_t>(axis);
        build(first, split, depth + 1);
        const std::uint32_t right = build(split, stop, depth + 1);
        tree_.nodes[number].right = right;
        return number;
    }

    std::size_t halves(std::size_t first, std::size_t stop, std::size_t axis) {
        const std::size_t half = first + (stop - first) / 2;
        const auto at = [&](std::size_t i) { return items_.begin() + static_cast<std::ptrdiff_t>(i); };
        std::nth_element(at(first), at(half), at(stop),
                         [&](const Item &a, const Item &b) { return a.middle[axis] < b.middle[axis]; });
        return half;
    }

    // Moves the items that lie before the best of the planes between the bins to the front. Returns where the
    // others begin; `first` where all middles are equal.
    std::size_t best_split(std::size_t first, std::size_t stop, const Box &box, const Box &middles,
                           std::size_t axis) {
        const float low = middles.low[axis], extent = middles.high[axis] - low;
        if (!(extent > 0)) {
            return first;
        }
        const auto bin_of = [&](const Item &item) {
            const float share = (item.middle[axis] - low) / extent;
            return std::min(bins - 1, static_cast<std::size_t>(share * static_cast<float>(bins)));
        };
        std::array<Box, bins> boxes;
        std::array<std::size_t, bins> counts{};
        for (std::size_t i = first; i < stop; ++i) {
            const std::size_t bin = bin_of(items_[i]);
            boxes[bin].add(items_[i].box);
            ++counts[bin];
        }
        std::array<float, bins> above{}; // cost of the bins from this one on
        Box right;
        std::size_t count = 0;
        for (std::size_t bin = bins; bin-- > 1;) {
            right.add(boxes[bin]);
            count += counts[bin];
            above[bin] = right.surface() * static_cast<float>(count);
        }
        Box left;
        count = 0;
        float least = infinity;
        std::size_t plane = 0;
        for (std::size_t bin = 1; bin < bins; ++bin) {
            left.add(boxes[bin - 1]);
            count += counts[bin - 1];
            const float cost = left.surface() * static_cast<float>(count) + above[bin];
            if (count > 0 && count < stop - first && cost < least) {
                least = cost;
                plane = bin;
            }
        }
        const float whole = box.surface() * static_cast<float>(stop - first);
        if (stop - first <= 4 * leaf_size && least + visit_cost * box.surface() >= whole) {
            return plane == 0 ? first : stop; // not worth a box
        }
        const auto at = [&](std::size_t i) { return items_.begin() + static_cast<std::ptrdiff_t>(i); };
        const auto middle =
            std::partition(at(first), at(stop), [&](const Item &item) { return bin_of(item) < plane; });
        return static_cast<std::size_t>(middle - items_.begin());
    }

    std::vector<Item> items_;
    Tree &tree_;
};

} // namespace

Tree build_tree(std::span<const float> positions, std::span<const std::uint32_t> triangles) {
    std::vector<Item> items;
    items.reserve(triangles.size() / 3);
    for (std::size_t t = 0; t + 2 < triangles.size(); t += 3) {
        Item item{};
        std::array<Position, 3> p;
        for (std::size_t c = 0; c < 3; ++c) {
            for (std::size_t k = 0; k < 3; ++k) {
                p[c][k] = item.corners[3 * c + k] = positions[3 * std::size_t{triangles[t + c]} + k];
            }
            item.box.add(p[c]);
        }
        std::array<double, 3> u, v;
        for (std::size_t k = 0; k < 3; ++k) {
            u[k] = static_cast<double>(p[1][k]) - p[0][k];
            v[k] = static_cast<double>(p[2][k]) - p[0][k];
            item.middle[k] = 0.5F * item.box.low[k] + 0.5F * item.box.high[k];
        }
        const bool has_area =
            u[1] * v[2] != u[2] * v[1] || u[2] * v[0] != u[0] * v[2] || u[0] * v[1] != u[1] * v[0];
        if (has_area) {
            items.push_back(item);
        }
    }
    Tree tree;
    Builder(std::move(items), tree);
    return tree;
}

} // namespace paradize::occlusion
