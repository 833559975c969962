// Which collapses leave the surface what it is.
#include <algorithm>
#include <cmath>

#include "simplify/work.hpp"

namespace paradize::simplify {

namespace {

constexpr double least_turn = 0.25;  // cosine of the angle by which a triangle may turn
constexpr double least_shape = 1e-4; // twice the area of a triangle, of its longest edge squared

// Whether the surface stays one of the same kind: the ends have no neighbours in common but the tips of
// the edge's triangles, and no triangle loses both its neighbours there.
bool meets_link_condition(Work &work, std::uint32_t h) {
    const Surface &surface = work.surface;
    const std::uint32_t t = surface.at(h).twin;
    const std::uint32_t vp = surface.at(h).vertex;
    const std::uint32_t vq = surface.at(next(h)).vertex;
    if (surface.locked[vp] != 0 && surface.locked[vq] != 0) {
        return false;
    }
    if (t != none && surface.border[vp] != 0 && surface.border[vq] != 0) {
        return false;
    }
    for (const std::uint32_t side : {h, t}) {
        if (side == none) {
            continue;
        }
        const std::uint32_t a = surface.at(next(side)).twin;
        const std::uint32_t b = surface.at(previous(side)).twin;
        if ((a == none && b == none) || (a != none && b != none && triangle_of(a) == triangle_of(b))) {
            return false;
        }
    }
    if (work.mark > none - 4) {
        std::fill(work.seen.begin(), work.seen.end(), 0);
        work.mark = 0;
    }
    work.mark += 2;
    for (const std::uint32_t i : work.ring_p) {
        work.seen[surface.at(next(i)).vertex] = work.mark;
        work.seen[surface.at(previous(i)).vertex] = work.mark;
    }
    work.seen[vp] = work.seen[vq] = 0;
    std::uint32_t common = 0;
    for (const std::uint32_t i : work.ring_q) {
        for (const std::uint32_t j : {next(i), previous(i)}) {
            std::uint32_t &s = work.seen[surface.at(j).vertex];
            common += s == work.mark;
            s += s == work.mark;
        }
    }
    return common == (t == none ? 1u : 2u);
}

// Whether a triangle with a corner that goes from `old` to `at` neither turns over nor becomes a line.
bool keeps_shape(Vec old, Vec at, Vec b, Vec c) {
    const Vec ab = b - at;
    const Vec ac = c - at;
    const Vec bc = c - b;
    const Vec before = cross(b - old, bc);
    const Vec after = cross(ab, bc);
    const double was = dot(before, before);
    const double is = dot(after, after);
    const double longest = std::max({dot(ab, ab), dot(ac, ac), dot(bc, bc)});
    if (!(is > least_shape * least_shape * longest * longest) && !(is > was)) {
        return false;
    }
    const double turn = dot(before, after);
    return is > 0 && turn >= 0 && turn * turn >= least_turn * least_turn * was * is;
}

bool keeps_shapes(const Work &work, std::uint32_t h, Vec at) {
    const Surface &surface = work.surface;
    const std::uint32_t mine = triangle_of(h);
    const std::uint32_t t = surface.at(h).twin;
    const std::uint32_t other = t == none ? mine : triangle_of(t);
    for (const Numbers *ring : {&work.ring_p, &work.ring_q}) {
        const Vec old = work.quadrics.vertices[surface.at(ring->front()).vertex].at;
        for (const std::uint32_t i : *ring) {
            if (triangle_of(i) != mine && triangle_of(i) != other &&
                !keeps_shape(old, at, work.quadrics.vertices[surface.at(next(i)).vertex].at,
                             work.quadrics.vertices[surface.at(previous(i)).vertex].at)) {
                return false;
            }
        }
    }
    return true;
}

// Whether the component keeps its share of area, and with `at` goes on having it.
bool keeps_area(Work &work, std::uint32_t h, Vec at) {
    if (work.limits.kept_area <= 0) {
        return true;
    }
    const Surface &surface = work.surface;
    const std::uint32_t mine = triangle_of(h);
    const std::uint32_t t = surface.at(h).twin;
    const std::uint32_t other = t == none ? mine : triangle_of(t);
    double change = 0.0;
    for (const Numbers *ring : {&work.ring_p, &work.ring_q}) {
        const Vec old = work.quadrics.vertices[surface.at(ring->front()).vertex].at;
        for (const std::uint32_t i : *ring) {
            const bool gone = triangle_of(i) == mine || triangle_of(i) == other;
            const Vec b = work.quadrics.vertices[surface.at(next(i)).vertex].at;
            const Vec bc = work.quadrics.vertices[surface.at(previous(i)).vertex].at - b;
            const double was = length(cross(b - old, bc));
            if (!gone) {
                change += length(cross(b - at, bc)) - was;
            } else if (ring == &work.ring_p) {
                change -= was;
            }
        }
    }
    const std::uint32_t component = surface.component[surface.at(h).vertex];
    if (change < 0.0 && work.component_area[component] + change < work.component_least_area[component]) {
        return false;
    }
    work.component_area[component] += change;
    return true;
}

// Whether a locked vertex would lose a wedge of its own.
bool merges_locked_wedge(const Surface &surface, std::uint32_t h) {
    const bool fixed_p = surface.locked[surface.at(h).vertex] != 0;
    const bool fixed_q = surface.locked[surface.at(next(h)).vertex] != 0;
    if (!fixed_p && !fixed_q) {
        return false;
    }
    const WedgeSet first = match_wedges(surface, h).set[0];
    return first.wedge[2] != none && (fixed_p ? first.third_is_p : !first.third_is_p);
}

} // namespace

bool allowed(Work &work, std::uint32_t h, Vec at) {
    return meets_link_condition(work, h) && !merges_locked_wedge(work.surface, h) &&
           keeps_shapes(work, h, at) && keeps_area(work, h, at);
}

} // namespace paradize::simplify
