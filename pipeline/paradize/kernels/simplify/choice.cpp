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
    Four x{}, y{}, z{}, one{};

    void add(Four plane, float weight) {
        const Four w = weight * plane;
        x += w[0] * plane, y += w[1] * plane, z += w[2] * plane, one += w[3] * plane;
    }
    void add_to(Quadric &all) const {
        all.xx += x[0], all.xy += x[1], all.xz += x[2], all.yy += y[1], all.yz += y[2], all.zz += z[2];
        all.x += x[3], all.y += y[3], all.z += z[3];
        all.c += one[3];
    }
};

Four floats(Vec v) {
    return Four{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z), 0};
}

// The linear function with its value at another origin, `by` from its own.
Four shifted(Four slope, Four by) {
    const Four step = slope * by;
    return Four{slope[0], slope[1], slope[2], slope[3] + (step[0] + step[1] + step[2])};
}

// Squared differences of two wedges about an origin that lies by_a from a's and by_b from b's.
void differ(const Memory &memory, const Four *a, Four by_a, const Four *b, Four by_b, Rows &rows) {
    const float area_a = a[0][0];
    const float area_b = b[0][0];
    if (!(area_a > 0) || !(area_b > 0)) {
        return;
    }
    const float both = area_a * (area_b / (area_a + area_b));
    for (std::size_t k = 0; k < memory.width; ++k) {
        const Four step = a[k + 1] * by_a - b[k + 1] * by_b;
        Four apart = a[k + 1] - b[k + 1];
        apart[3] += step[0] + step[1] + step[2];
        rows.add(apart, both * memory.squares[k]);
    }
}

} // namespace

Sets match(const Surface &surface, std::uint32_t h) {
    const Half &here = surface.at(h);
    const std::uint32_t a = here.wedge;
    const std::uint32_t b = surface.at(next(h)).wedge;
    Sets sets{{Set{{a, b, none}, false}, Set{{none, none, none}, false}}, 1};
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

void unite(const Memory &memory, Four *into, Vec at_into, const Four *other, Vec at_other, Vec at,
           Quadric &all) {
    const Four by_into = floats(at - at_into);
    const Four by_other = floats(at - at_other);
    if (memory.weighed) {
        Rows rows;
        differ(memory, into, by_into, other, by_other, rows);
        rows.add_to(all);
    }
    const float sum = into[0][0] + other[0][0];
    const float share = sum > 0 ? other[0][0] / sum : 0.0F;
    for (std::size_t k = 1; k < memory.stride; ++k) {
        const Four mine = shifted(into[k], by_into);
        into[k] = mine + share * (shifted(other[k], by_other) - mine);
    }
    into[0][0] = sum;
}

Choice choose(const Surface &surface, const Memory &memory, std::uint32_t h, bool exact) {
    const std::uint32_t vp = surface.at(h).vertex;
    const std::uint32_t vq = surface.at(next(h)).vertex;
    const Corner &p = memory.corners[vp];
    const Corner &q = memory.corners[vq];
    // All from the edge's middle on.
    const Vec middle = 0.5 * (p.at + q.at);
    const Vec half = 0.5 * (q.at - p.at);
    Quadric all = p.all;
    all += q.all;
    all.look_from(middle);
    if (exact) {
        Rows rows;
        const Four by = floats(half);
        for (const auto &[wedge, third_is_p] : match(surface, h)) {
            const Four *a = memory.wedge(wedge[0]);
            const Four *b = memory.wedge(wedge[1]);
            if (wedge[2] == none) {
                differ(memory, a, by, b, -by, rows);
                continue;
            }
            std::array<Four, most_attributes + 1> mean;
            std::copy(a, a + memory.stride, mean.begin());
            unite(memory, mean.data(), p.at, b, q.at, middle, all);
            differ(memory, mean.data(), Four{}, memory.wedge(wedge[2]), third_is_p ? by : -by, rows);
        }
        rows.add_to(all);
    }
    Choice choice{};
    const double square = 4.0 * dot(half, half);
    const bool fixed_p = surface.locked[vp] != 0;
    if (fixed_p || surface.locked[vq] != 0) {
        choice.at = fixed_p ? p.at : q.at;
        choice.cost = all.value(choice.at - middle);
    } else {
        Vec off;
        if (least(all, damping, off) && dot(off, off) <= far_off * far_off * square) {
            choice.at = middle + off;
            choice.cost = all.value(off);
        } else {
            const double at_p = all.value(-1.0 * half);
            const double at_q = all.value(half);
            choice.at = at_p <= at_q ? p.at : q.at;
            choice.cost = std::min(at_p, at_q);
        }
    }
    choice.cost = std::max(choice.cost, 0.0);
    const double area = p.area + q.area;
    choice.error = area > 0 ? std::sqrt(choice.cost / area) : 0.0;
    choice.cost += short_first * square * square;
    return choice;
}

} // namespace paradize::simplify
