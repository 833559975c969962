#include "atlas/border.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "math/disjoint_sets.hpp"

namespace paradize::atlas {

namespace {

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

// Triangles around a corner, each beside the next: all around it, or from one edge of the border to another.
// Where two fans share nothing but their corner, the chart is pinched.
struct Fan {
    std::uint32_t corner;
    std::uint32_t out = none, in = none; // fans at the other ends of the border's edges
};

class Fans {
  public:
    explicit Fans(std::span<const Triangle> triangles) : sets_(3 * triangles.size()) {
        const std::size_t corners = 3 * triangles.size();
        struct Side {
            std::uint32_t low, high, corner; // 3 t + k
            bool turned;
        };
        std::vector<Side> sides;
        sides.reserve(corners);
        for (std::uint32_t c = 0; c < corners; ++c) {
            const auto &corner = triangles[c / 3].corner;
            const std::uint32_t i = corner[c % 3], j = corner[(c + 1) % 3];
            sides.push_back({std::min(i, j), std::max(i, j), c, i > j});
        }
        std::ranges::sort(sides, {}, [](const Side &s) { return std::tie(s.low, s.high, s.corner); });
        std::vector<std::uint32_t> border;
        for (std::size_t i = 0, end = 0; i < sides.size(); i = end) {
            while (end < sides.size() && sides[end].low == sides[i].low && sides[end].high == sides[i].high) {
                ++end;
            }
            if (end - i == 2 && sides[i].turned != sides[i + 1].turned) {
                sets_.join(sides[i].corner, after(sides[i + 1].corner));
                sets_.join(after(sides[i].corner), sides[i + 1].corner);
                continue;
            }
            for (std::size_t k = i; k < end; ++k) {
                border.push_back(sides[k].corner);
            }
        }
        std::vector<std::uint32_t> fan(corners, none);
        for (std::uint32_t c = 0; c < corners; ++c) {
            if (sets_.root(c) == c) {
                fan[c] = static_cast<std::uint32_t>(all.size());
                all.push_back({triangles[c / 3].corner[c % 3]});
            }
        }
        for (const std::uint32_t c : border) {
            const std::uint32_t from = fan[sets_.root(c)], to = fan[sets_.root(after(c))];
            all[from].out = to;
            all[to].in = from;
        }
    }

    std::vector<Fan> all;

  private:
    static std::uint32_t after(std::uint32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }

    DisjointSets sets_; // of corners
};

using BorderEdge = std::array<std::uint32_t, 2>;

bool cross_each_other(std::span<const Vec> places, const BorderEdge &e, const BorderEdge &f) {
    if (e[0] == f[0] || e[0] == f[1] || e[1] == f[0] || e[1] == f[1]) {
        return false;
    }
    const Vec a = places[e[0]], b = places[e[1]], c = places[f[0]], d = places[f[1]];
    const double x = cross(b - a, c - a), y = cross(b - a, d - a);
    const double z = cross(d - c, a - c), w = cross(d - c, b - c);
    return ((x > 0) != (y > 0)) && ((z > 0) != (w > 0));
}

// Whether two edges meet elsewhere than at a common end.
bool any_cross(std::span<const BorderEdge> edges, std::span<const Vec> places) {
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
        return false;
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

// How many of the border's loops have the plane's inside to their left: one, where there is an area.
std::size_t loops_round_something(const std::vector<Fan> &fans, std::span<const Vec> places) {
    std::vector<bool> seen(fans.size());
    std::size_t count = 0;
    for (std::size_t start = 0; start < fans.size(); ++start) {
        const Vec from = places[fans[start].corner];
        double area = 0;
        for (std::size_t at = start; fans[at].out != none && !seen[at]; at = fans[at].out) {
            seen[at] = true;
            area += cross(places[fans[at].corner] - from, places[fans[fans[at].out].corner] - from);
        }
        count += area > 0 ? 1 : 0;
    }
    return count;
}

// From the edge that leaves a corner against the clock to the one that comes in.
struct Wedge {
    Vec out, in;

    bool holds(Vec v) const {
        if (cross(out, in) > 0) {
            return cross(out, v) > 0 && cross(v, in) > 0;
        }
        return !(cross(in, v) >= 0 && cross(v, out) >= 0);
    }
};

bool same_way(Vec a, Vec b) {
    return cross(a, b) == 0 && a.x * b.x + a.y * b.y > 0;
}

// Whether two fans of one corner lie over each other.
bool any_pinch_overlaps(const std::vector<Fan> &fans, std::span<const Vec> places) {
    std::vector<std::uint32_t> order(fans.size());
    std::iota(order.begin(), order.end(), 0U);
    std::ranges::stable_sort(order, {}, [&](std::uint32_t f) { return fans[f].corner; });
    const auto wedge = [&](const Fan &fan) {
        const Vec at = places[fan.corner];
        return Wedge{places[fans[fan.out].corner] - at, places[fans[fan.in].corner] - at};
    };
    for (std::size_t i = 0; i < order.size(); ++i) {
        const Fan &one = fans[order[i]];
        for (std::size_t j = i + 1; j < order.size() && fans[order[j]].corner == one.corner; ++j) {
            const Fan &other = fans[order[j]];
            if (one.out == none || other.out == none) { // all around the corner
                return true;
            }
            const Wedge a = wedge(one), b = wedge(other);
            if (a.holds(b.out) || a.holds(b.in) || b.holds(a.out) || b.holds(a.in) ||
                same_way(a.out, b.out) || same_way(a.in, b.in)) {
                return true;
            }
        }
    }
    return false;
}

} // namespace

bool overlaps_itself(std::span<const Triangle> triangles, std::span<const Vec> places) {
    const std::vector<Fan> fans = Fans(triangles).all;
    std::vector<BorderEdge> border;
    for (const Fan &fan : fans) {
        if (fan.out != none) {
            border.push_back({fan.corner, fans[fan.out].corner});
        }
    }
    return border.empty() || any_pinch_overlaps(fans, places) || any_cross(border, places) ||
           loops_round_something(fans, places) > 1;
}

} // namespace paradize::atlas
