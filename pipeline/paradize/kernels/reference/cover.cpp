#include "reference/cover.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace paradize::reference {
namespace {

constexpr double needle_share =
    1e-10; // squared width of a needle, of its length's square: signs are unsure there
constexpr double least_share = 0.2; // of a polygon's area, that is worth being taken away
constexpr double line = 1e-12; // area of what is only a line, of its length's square: areas are unsure there

double to_side(const Point &p, const Point &a, const Point &side) {
    const Point off = minus(p, a);
    const double along_it = dot(off, side), length = dot(side, side);
    if (!(along_it > 0))
        return dot(off, off);
    const Point left = minus(off, along({}, along_it < length ? along_it / length : 1.0, side));
    return dot(left, left);
}

double longest_of(const Polygon &polygon) {
    double longest = 0;
    for (std::size_t k = 0; k < polygon.count; ++k) {
        const Point side = minus(polygon.at[(k + 1) % polygon.count], polygon.at[k]);
        longest = std::max(longest, dot(side, side));
    }
    return longest;
}

double area_of(const Polygon &polygon) {
    Point sum{};
    for (std::size_t k = 2; k < polygon.count; ++k)
        sum = along(sum, 1.0,
                    cross(minus(polygon.at[k - 1], polygon.at[0]), minus(polygon.at[k], polygon.at[0])));
    return std::sqrt(dot(sum, sum));
}

} // namespace

Target::Target(const Corners &corners)
    : at_(corners), u_(minus(at_[1], at_[0])), v_(minus(at_[2], at_[0])), normal_(cross(u_, v_)),
      long_side_(std::max(dot(u_, u_), dot(v_, v_))), area_(dot(normal_, normal_)),
      needle_(area_ <= needle_share * long_side_ * long_side_) {}

double Target::distance(const Point &p) const {
    return std::sqrt(squared(p));
}

// The nearest lies inside or on a side that the place is outside of.
double Target::squared(const Point &p) const {
    const Point w = minus(p, at_[0]);
    const double one = dot(cross(w, v_), normal_), two = dot(cross(u_, w), normal_), zero = area_ - one - two;
    double best = std::numeric_limits<double>::max();
    if (one > 0 && two > 0 && zero > 0) {
        const Point off = minus(w, along(along({}, one / area_, u_), two / area_, v_));
        best = dot(off, off);
        if (!needle_)
            return best;
    }
    if (needle_ || !(one > 0))
        best = std::min(best, to_side(p, at_[0], v_));
    if (needle_ || !(two > 0))
        best = std::min(best, to_side(p, at_[0], u_));
    if (needle_ || !(zero > 0))
        best = std::min(best, to_side(p, at_[1], minus(at_[2], at_[1])));
    return best;
}

// Up to where the segment leaves the triangle's prism, and from there on by false position: by convexity the
// share found is never too large.
double Target::within(const Point &a, const Point &b, double from, double to, double enough) const {
    const Point whole = minus(b, a), w = minus(a, at_[0]);
    const double one = dot(cross(w, v_), normal_), two = dot(cross(u_, w), normal_);
    const double d_one = dot(cross(whole, v_), normal_), d_two = dot(cross(u_, whole), normal_);
    double share = 0, leaves = 1;
    for (const auto &[here, change] :
         {std::pair{one, d_one}, std::pair{two, d_two}, std::pair{area_ - one - two, -d_one - d_two}})
        if (here + change < 0)
            leaves = std::min(leaves, here / -change);
    if (leaves > 0 && leaves < 1)
        if (const double there = distance(along(a, leaves, whole)); there <= enough) {
            share = leaves;
            from = there;
        }
    for (int step = 0; step < 3; ++step) {
        const double next = share + (1 - share) * (enough - from) / (to - from);
        const double there = distance(along(a, next, whole));
        if (!(there <= enough) || !(next > share))
            break;
        share = next;
        from = there;
    }
    return share;
}

Point middle(const Polygon &polygon) {
    Point sum{};
    for (std::size_t k = 0; k < polygon.count; ++k)
        sum = along(sum, 1.0, polygon.at[k]);
    return along({}, 1.0 / static_cast<double>(polygon.count), sum);
}

std::array<Polygon, 2> halves(const Polygon &polygon) {
    const std::size_t n = polygon.count;
    std::size_t side = 0;
    double longest = -1;
    for (std::size_t k = 0; k < n; ++k) {
        const Point s = minus(polygon.at[(k + 1) % n], polygon.at[k]);
        if (const double length = dot(s, s); length > longest) {
            longest = length;
            side = k;
        }
    }
    const Point &a = polygon.at[side], &b = polygon.at[(side + 1) % n];
    const Point cut = along(a, 0.5, minus(b, a));
    const std::size_t across = (n + 1) / 2; // corners of the first part besides the cut
    std::array<Polygon, 2> out;
    out[0].add(cut);
    out[1].add(cut);
    for (std::size_t k = 0; k < across; ++k)
        out[0].add(polygon.at[(side + 1 + k) % n]);
    for (std::size_t k = across - 1; k < n; ++k)
        out[1].add(polygon.at[(side + 1 + k) % n]);
    return out;
}

ClippedPolygon beyond(const Polygon &polygon, const Target &target, double enough) {
    const std::size_t n = polygon.count;
    std::array<double, Polygon::most> off;
    ClippedPolygon rest;
    std::size_t first = n; // a corner that is near, after one that is not
    for (std::size_t k = 0; k < n; ++k) {
        off[k] = std::sqrt(target.squared(polygon.at[k]));
        rest.farthest = std::max(rest.farthest, off[k]);
        if (off[k] <= enough)
            rest.near = std::max(rest.near, off[k]);
    }
    if (rest.farthest <= enough)
        return rest;
    for (std::size_t k = 0; k < n; ++k)
        if (off[k] <= enough && off[(k + 1) % n] > enough)
            first = k;
    rest.worth = false;
    if (first == n)
        return rest;
    double left = 0;
    const auto crossing = [&](std::size_t near, std::size_t far) {
        const Point &a = polygon.at[near], &b = polygon.at[far];
        const Point p = along(a, target.within(a, b, off[near], off[far], enough), minus(b, a));
        rest.near = std::max(rest.near, std::sqrt(target.squared(p)));
        return p;
    };
    for (std::size_t k = 0; k < n;) {
        const std::size_t start = (first + k) % n;
        if (off[(start + 1) % n] <= enough) {
            ++k;
            continue;
        }
        std::size_t run = 0;
        while (off[(start + 1 + run) % n] > enough)
            ++run;
        if (run + 2 > Polygon::most) {
            rest.count = 0;
            return rest;
        }
        Polygon &part = rest.parts[rest.count++];
        part.add(crossing(start, (start + 1) % n));
        for (std::size_t i = 0; i < run; ++i)
            part.add(polygon.at[(start + 1 + i) % n]);
        part.add(crossing((start + 1 + run) % n, (start + run) % n));
        left += area_of(part);
        k += 1 + run;
    }
    const double area = area_of(polygon);
    rest.worth = area > line * longest_of(polygon) && left <= (1 - least_share) * area;
    if (!rest.worth)
        rest.count = 0;
    return rest;
}

} // namespace paradize::reference
