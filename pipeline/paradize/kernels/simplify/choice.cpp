#include "simplify/choice.hpp"

#include <algorithm>
#include <cmath>

namespace paradize::simplify {

namespace {

constexpr double damping = 1e-6;     // of the trace: directions that count for less are left as they are
constexpr double far_off = 2.0;      // edge lengths that a vertex may be placed off the edge's middle
constexpr double short_first = 1e-9; // of an edge's length to the fourth: short ones first on flat ground
constexpr std::size_t most_attributes = 32;

// A form in floats, of (x, y, z, 1): its rows.
struct Rows {
    Float4 x{}, y{}, z{}, one{};

    void add(Float4 plane, float weight) {
        const Float4 w = weight * plane;
        x += w[0] * plane, y += w[1] * plane, z += w[2] * plane, one += w[3] * plane;
    }
    void add_to(Quadric &all) const {
        all.xx += x[0], all.xy += x[1], all.xz += x[2], all.yy += y[1], all.yz += y[2], all.zz += z[2];
        all.x += x[3], all.y += y[3], all.z += z[3];
        all.c += one[3];
    }
};

Float4 floats(Vec v) {
    return Float4{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z), 0};
}

// The linear function with its value at another origin, `by` from its own.
Float4 shifted(Float4 slope, Float4 by) {
    const Float4 step = slope * by;
    return Float4{slope[0], slope[1], slope[2], slope[3] + (step[0] + step[1] + step[2])};
}

// Squared differences of two wedges about an origin that lies by_a from a's and by_b from b's.
void differ(const Quadrics &quadrics, const Float4 *a, Float4 by_a, const Float4 *b, Float4 by_b,
            Rows &rows) {
    const float area_a = a[0][0];
    const float area_b = b[0][0];
    if (!(area_a > 0) || !(area_b > 0)) {
        return;
    }
    const float both = area_a * (area_b / (area_a + area_b));
    for (std::size_t k = 0; k < quadrics.width; ++k) {
        const Float4 step = a[k + 1] * by_a - b[k + 1] * by_b;
        Float4 apart = a[k + 1] - b[k + 1];
        apart[3] += step[0] + step[1] + step[2];
        rows.add(apart, both * quadrics.squares[k]);
    }
}

} // namespace

WedgeSets match_wedges(const Surface &surface, std::uint32_t h) {
    const Half &here = surface.at(h);
    const std::uint32_t a = here.wedge;
    const std::uint32_t b = surface.at(next(h)).wedge;
    WedgeSets sets{{WedgeSet{{a, b, none}, false}, WedgeSet{{none, none, none}, false}}, 1};
    if (here.twin == none) {
        return sets;
    }
    const std::uint32_t other_a = surface.at(next(here.twin)).wedge;
    const std::uint32_t other_b = surface.at(here.twin).wedge;
    if (other_a == a && other_b == b) {
        return sets;
    }
    if (other_a == a) {
        sets.set[0].wedge[2] = other_b;
    } else if (other_b == b) {
        sets.set[0].wedge[2] = other_a;
        sets.set[0].third_is_p = true;
    } else {
        sets.set[1] = {{other_a, other_b, none}, false};
        sets.count = 2;
    }
    return sets;
}

void merge_attributes(const Quadrics &quadrics, Float4 *into, Vec at_into, const Float4 *other, Vec at_other,
                      Vec at, Quadric &all) {
    const Float4 by_into = floats(at - at_into);
    const Float4 by_other = floats(at - at_other);
    if (quadrics.weighed) {
        Rows rows;
        differ(quadrics, into, by_into, other, by_other, rows);
        rows.add_to(all);
    }
    const float sum = into[0][0] + other[0][0];
    const float share = sum > 0 ? other[0][0] / sum : 0.0F;
    for (std::size_t k = 1; k < quadrics.stride; ++k) {
        const Float4 mine = shifted(into[k], by_into);
        into[k] = mine + share * (shifted(other[k], by_other) - mine);
    }
    into[0][0] = sum;
}

Placement optimal_placement(const Surface &surface, const Quadrics &quadrics, std::uint32_t h, bool exact) {
    const std::uint32_t vp = surface.at(h).vertex;
    const std::uint32_t vq = surface.at(next(h)).vertex;
    const VertexQuadric &p = quadrics.vertices[vp];
    const VertexQuadric &q = quadrics.vertices[vq];
    // All from the edge's middle on.
    const Vec middle = 0.5 * (p.at + q.at);
    const Vec half = 0.5 * (q.at - p.at);
    Quadric all = p.all;
    all += q.all;
    all.look_from(middle);
    if (exact) {
        Rows rows;
        const Float4 by = floats(half);
        for (const auto &[wedge, third_is_p] : match_wedges(surface, h)) {
            const Float4 *a = quadrics.wedge(wedge[0]);
            const Float4 *b = quadrics.wedge(wedge[1]);
            if (wedge[2] == none) {
                differ(quadrics, a, by, b, -by, rows);
                continue;
            }
            std::array<Float4, most_attributes + 1> mean;
            std::copy(a, a + quadrics.stride, mean.begin());
            merge_attributes(quadrics, mean.data(), p.at, b, q.at, middle, all);
            differ(quadrics, mean.data(), Float4{}, quadrics.wedge(wedge[2]), third_is_p ? by : -by, rows);
        }
        rows.add_to(all);
    }
    Placement placement{};
    const double square = 4.0 * dot(half, half);
    const bool fixed_p = surface.locked[vp] != 0;
    if (fixed_p || surface.locked[vq] != 0) {
        placement.at = fixed_p ? p.at : q.at;
        placement.cost = all.value(placement.at - middle);
    } else {
        Vec off;
        if (least(all, damping, off) && dot(off, off) <= far_off * far_off * square) {
            placement.at = middle + off;
            placement.cost = all.value(off);
        } else {
            const double at_p = all.value(-1.0 * half);
            const double at_q = all.value(half);
            placement.at = at_p <= at_q ? p.at : q.at;
            placement.cost = std::min(at_p, at_q);
        }
    }
    placement.cost = std::max(placement.cost, 0.0);
    placement.cost += short_first * square * square;
    return placement;
}

} // namespace paradize::simplify
