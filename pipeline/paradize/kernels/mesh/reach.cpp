#include "mesh/reach.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <iterator>
#include <limits>
#include <numeric>
#include <queue>
#include <utility>

#include "math/disjoint_sets.hpp"

namespace paradize::mesh {

namespace {

using Index = std::uint32_t;
using Point = std::array<double, 3>;
constexpr Index none = std::numeric_limits<Index>::max();
constexpr double far = std::numeric_limits<double>::infinity();

double squared(const Point &a, const Point &b) {
    const double x = a[0] - b[0];
    const double y = a[1] - b[1];
    const double z = a[2] - b[2];
    return x * x + y * y + z * z;
}

// A k-d tree (J. L. Bentley, 1975) that finds the nearest place of another set.
class PlaceTree {
  public:
    explicit PlaceTree(const std::vector<Point> &places) : places_(places), order_(places.size()) {
        std::iota(order_.begin(), order_.end(), Index{0});
        build(0, static_cast<Index>(places.size()));
    }

    // sets: of each place. Call after sets have changed.
    void set_names(const std::vector<Index> &sets) {
        sets_ = &sets;
        for (std::size_t i = nodes_.size(); i-- > 0;) {
            Node &node = nodes_[i];
            if (node.right == 0) {
                node.set = sets[order_[node.first]];
                for (Index k = node.first; k < node.last; ++k) {
                    node.set = sets[order_[k]] == node.set ? node.set : none;
                }
            } else {
                const Index left = nodes_[i + 1].set;
                node.set = left == nodes_[node.right].set ? left : none;
            }
        }
    }

    struct NearestPlace {
        double squared = far;
        Index place = none;
    };
    // Finds the nearest place of another set than `own`, where there is one at most as far as `found`; of
    // equals the first by coordinates.
    void nearest(const Point &point, Index own, NearestPlace &found, Index at = 0) const {
        const Node &node = nodes_[at];
        if (node.set == own || distance(node, point) > found.squared) {
            return;
        }
        if (node.right == 0) {
            for (Index k = node.first; k < node.last; ++k) {
                const Index place = order_[k];
                const double away = squared(places_[place], point);
                if ((*sets_)[place] != own &&
                    (away < found.squared || (away == found.squared && comes_first(place, found.place)))) {
                    found = {away, place};
                }
            }
            return;
        }
        const std::array<Index, 2> children{at + 1, node.right};
        const bool right_first = distance(nodes_[node.right], point) < distance(nodes_[at + 1], point);
        nearest(point, own, found, children[right_first ? 1 : 0]);
        nearest(point, own, found, children[right_first ? 0 : 1]);
    }

  private:
    struct Node {
        Point low{far, far, far}, high{-far, -far, -far};
        Index first = 0, last = 0; // in order_
        Index right = 0;           // the left child follows the node; 0: a leaf
        Index set = none;          // of all its places; none: of several
    };
    static constexpr Index leaf = 8;

    bool comes_first(Index place, Index before) const {
        return before == none || places_[place] < places_[before];
    }
    static double distance(const Node &node, const Point &point) {
        double sum = 0.0;
        for (std::size_t k = 0; k < 3; ++k) {
            const double away = std::max({node.low[k] - point[k], point[k] - node.high[k], 0.0});
            sum += away * away;
        }
        return sum;
    }
    Index build(Index first, Index last) {
        const auto at = static_cast<Index>(nodes_.size());
        Node node{.first = first, .last = last};
        for (Index k = first; k < last; ++k) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                node.low[axis] = std::min(node.low[axis], places_[order_[k]][axis]);
                node.high[axis] = std::max(node.high[axis], places_[order_[k]][axis]);
            }
        }
        nodes_.push_back(node);
        if (last - first > leaf) {
            std::size_t axis = 0;
            for (std::size_t k = 1; k < 3; ++k) {
                axis = node.high[k] - node.low[k] > node.high[axis] - node.low[axis] ? k : axis;
            }
            const Index middle = first + (last - first) / 2;
            std::nth_element(order_.begin() + first, order_.begin() + middle, order_.begin() + last,
                             [&](Index a, Index b) {
                                 return std::pair(places_[a][axis], a) < std::pair(places_[b][axis], b);
                             });
            build(first, middle);
            const Index right = build(middle, last);
            nodes_[at].right = right;
        }
        return at;
    }

    const std::vector<Point> &places_;
    const std::vector<Index> *sets_ = nullptr;
    std::vector<Index> order_;
    std::vector<Node> nodes_;
};

struct Edge {
    Index from = 0, to = 0;
};

// A gap between two sets. Gaps are compared by length, then by the coordinates of their ends, so that the
// order of the places does not matter.
struct Gap {
    double squared = far;
    Index from = none, to = none;
};

bool is_less(const std::vector<Point> &places, const Gap &a, const Gap &b) {
    if (a.squared != b.squared || a.from == none || b.from == none) {
        return a.squared < b.squared;
    }
    const auto ends = [&](const Gap &gap) { return std::minmax(places[gap.from], places[gap.to]); };
    return ends(a) < ends(b);
}

// Returns edges that join all sets with a place, each where it comes nearest to another.
std::vector<Edge> bridges(const std::vector<Point> &places, DisjointSets &sets) {
    const auto count = static_cast<Index>(places.size());
    PlaceTree tree(places);
    std::vector<Edge> out;
    std::vector<Index> names(count);
    std::vector<Gap> shortest(count); // by the name of a set
    for (;;) {
        bool several = false;
        for (Index i = 0; i < count; ++i) {
            names[i] = sets.root(i);
            several = several || names[i] != names[0];
            shortest[i] = {};
        }
        if (!several) {
            return out;
        }
        tree.set_names(names);
        for (Index i = 0; i < count; ++i) {
            Gap &known = shortest[names[i]];
            PlaceTree::NearestPlace found{known.squared, none};
            tree.nearest(places[i], names[i], found);
            if (const Gap gap{found.squared, i, found.place};
                found.place != none && is_less(places, gap, known)) {
                known = gap;
            }
        }
        std::vector<Gap> gaps;
        std::ranges::copy_if(shortest, std::back_inserter(gaps),
                             [](const Gap &gap) { return gap.from != none; });
        std::ranges::sort(gaps, [&](const Gap &a, const Gap &b) { return is_less(places, a, b); });
        for (const Gap &gap : gaps) {
            if (sets.root(gap.from) != sets.root(gap.to)) {
                out.push_back({gap.from, gap.to});
                sets.join(gap.from, gap.to);
            }
        }
    }
}

std::vector<double> shortest(const std::vector<Point> &places, const std::vector<Edge> &edges,
                             const std::vector<Index> &roots) {
    std::vector<std::size_t> start(places.size() + 1);
    for (const Edge &edge : edges) {
        ++start[edge.from + 1];
        ++start[edge.to + 1];
    }
    std::partial_sum(start.begin(), start.end(), start.begin());
    std::vector<Index> neighbours(2 * edges.size());
    std::vector<std::size_t> filled(start.begin(), start.end() - 1);
    for (const Edge &edge : edges) {
        neighbours[filled[edge.from]++] = edge.to;
        neighbours[filled[edge.to]++] = edge.from;
    }
    std::vector<double> out(places.size(), far);
    using Entry = std::pair<double, Index>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    for (const Index root : roots) {
        out[root] = 0.0;
        queue.emplace(0.0, root);
    }
    while (!queue.empty()) {
        const auto [distance, at] = queue.top();
        queue.pop();
        if (distance > out[at]) {
            continue;
        }
        for (std::size_t k = start[at]; k < start[at + 1]; ++k) {
            const Index next = neighbours[k];
            const double along = distance + std::sqrt(squared(places[at], places[next]));
            if (along < out[next]) {
                out[next] = along;
                queue.emplace(along, next);
            }
        }
    }
    return out;
}

} // namespace

RootDistances reach(std::span<const float> places, std::span<const std::uint32_t> triangles, double rooted) {
    const auto count = static_cast<Index>(places.size() / 3);
    RootDistances out;
    if (count == 0) {
        return out;
    }
    std::vector<Point> points(count);
    double low = far;
    double high = -far;
    for (std::size_t i = 0; i < count; ++i) {
        points[i] = {places[3 * i], places[3 * i + 1], places[3 * i + 2]};
        low = std::min(low, points[i][1]);
        high = std::max(high, points[i][1]);
    }
    DisjointSets parts(count);
    std::vector<Edge> edges;
    edges.reserve(triangles.size());
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const Index next = triangles[i % 3 == 2 ? i - 2 : i + 1];
        edges.push_back({triangles[i], next});
        parts.join(triangles[i], next);
    }
    std::vector<Index> roots;
    std::vector<char> stands(count); // by the name of a part
    for (Index i = 0; i < count; ++i) {
        if (points[i][1] <= low + rooted * (high - low)) {
            roots.push_back(i);
            stands[parts.root(i)] = 1;
        }
    }
    DisjointSets joined = parts;
    for (Index i = 0; i < count; ++i) {
        if (stands[parts.root(i)] != 0) {
            joined.join(i, roots.front());
        }
    }
    DisjointSets branches = parts;
    for (const Edge &bridge : bridges(points, joined)) {
        edges.push_back(bridge);
        if (stands[parts.root(bridge.from)] == 0 && stands[parts.root(bridge.to)] == 0) {
            branches.join(bridge.from, bridge.to);
        }
    }
    out.from_root = shortest(points, edges, roots);
    out.in_branch.resize(count);
    std::vector<double> begins(count, far), ends(count); // by the name of a branch
    for (Index i = 0; i < count; ++i) {
        const Index name = branches.root(i);
        begins[name] = std::min(begins[name], out.from_root[i]);
        ends[name] = std::max(ends[name], out.from_root[i]);
    }
    for (Index i = 0; i < count; ++i) {
        const Index name = branches.root(i);
        if (stands[parts.root(i)] == 0 && ends[name] > begins[name]) {
            out.in_branch[i] = (out.from_root[i] - begins[name]) / (ends[name] - begins[name]);
        }
    }
    return out;
}

} // namespace paradize::mesh
