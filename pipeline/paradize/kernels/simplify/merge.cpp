// One collapse: triangles, wedges and vertices become fewer.
#include <algorithm>
#include <utility>

#include "simplify/work.hpp"

namespace paradize::simplify {

namespace {

// Drops the triangle of half-edge `side`, and joins the triangles on its two other sides.
void close(Work &work, std::uint32_t side) {
    Surface &surface = work.surface;
    const std::uint32_t a = surface.at(next(side)).twin;
    const std::uint32_t b = surface.at(previous(side)).twin;
    // The edge that waits in the queue stays: its place there is no higher than its cost.
    std::uint32_t keep = surface.at(previous(side)).edge;
    std::uint32_t drop = surface.at(next(side)).edge;
    if (work.state[keep] != queued && work.state[drop] == queued) {
        std::swap(keep, drop);
    }
    work.state[drop] = dead;
    for (const auto &[i, j] : {std::pair{a, b}, std::pair{b, a}}) {
        if (i != none) {
            surface.at(i).twin = j;
            surface.at(i).edge = keep;
            surface.half[keep] = i;
        }
    }
    surface.triangle[triangle_of(side)].alive = 0;
    --work.left;
}

void rename(Work &work, std::uint32_t from, std::uint32_t to) {
    for (const Numbers *ring : {&work.ring_p, &work.ring_q}) {
        for (const std::uint32_t i : *ring) {
            if (work.surface.at(i).wedge == from) {
                work.surface.at(i).wedge = to;
            }
        }
    }
}

// Wedges that stay alone: their values are those at the vertex, wherever it goes.
void carry(Work &work, const Numbers &ring, const WedgeSets &sets, Vec from, Vec at) {
    const Vec by = at - from;
    if (by == Vec{}) {
        return;
    }
    work.done.clear();
    for (const std::uint32_t i : ring) {
        const std::uint32_t w = work.surface.at(i).wedge;
        const bool merges = std::any_of(sets.begin(), sets.end(), [&](const WedgeSet &set) {
            return std::find(set.wedge.begin(), set.wedge.end(), w) != set.wedge.end();
        });
        if (merges || std::find(work.done.begin(), work.done.end(), w) != work.done.end()) {
            continue;
        }
        work.done.push_back(w);
        Float4 *wedge = work.quadrics.wedge(w);
        for (std::size_t k = 1; k < work.quadrics.stride; ++k) {
            wedge[k][3] += static_cast<float>(wedge[k][0] * by.x + wedge[k][1] * by.y + wedge[k][2] * by.z);
        }
    }
}

// Wedges that become one, and what they differ.
void merge(Work &work, const WedgeSets &sets, VertexQuadric &p, const VertexQuadric &q, Vec at, bool fixed_p,
           bool fixed_q) {
    Quadric drift;
    for (const auto &[wedge, third_is_p] : sets) {
        Float4 *into = work.quadrics.wedge(wedge[0]);
        // A locked vertex keeps its attributes: it stays.
        const std::uint32_t stays = fixed_p ? wedge[0] : fixed_q ? wedge[1] : none;
        float moved = moved_on;
        if (stays != none) {
            moved = work.quadrics.wedge(stays)[0][1];
        }
        const std::uint32_t source =
            stays != none ? work.surface.source[stays] : work.surface.source[wedge[0]];
        merge_attributes(work.quadrics, into, p.at, work.quadrics.wedge(wedge[1]), q.at, at, drift);
        rename(work, wedge[1], wedge[0]);
        if (wedge[2] != none) {
            merge_attributes(work.quadrics, into, at, work.quadrics.wedge(wedge[2]), third_is_p ? p.at : q.at,
                             at, drift);
            rename(work, wedge[2], wedge[0]);
        }
        into[0][1] = moved;
        work.surface.source[wedge[0]] = source;
    }
    drift.look_from(-1.0 * at);
    p.all += q.all;
    p.all += drift;
}

// Edges round the vertex that had been put aside are tried again.
void refresh(Work &work, std::uint32_t start, std::uint32_t v, bool several, bool stays,
             std::uint32_t bucket) {
    Surface &surface = work.surface;
    std::uint8_t split = 0;
    const std::uint32_t one = surface.at(start).wedge;
    around(surface, start, [&](std::uint32_t i) {
        const Half &half = surface.at(i);
        split |= half.wedge != one;
        if (several && !stays) {
            work.quadrics.wedge(half.wedge)[0][1] = moved_on;
        }
        for (const std::uint32_t e : {half.edge, surface.at(previous(i)).edge}) {
            if (work.state[e] == parked) {
                work.state[e] = queued;
                work.queue.push(e, bucket);
            }
        }
    });
    surface.split[v] = several ? split : 0;
}

} // namespace

void collapse(Work &work, std::uint32_t h, Vec at, std::uint32_t bucket) {
    Surface &surface = work.surface;
    const std::uint32_t t = surface.at(h).twin;
    const std::uint32_t vp = surface.at(h).vertex;
    const std::uint32_t vq = surface.at(next(h)).vertex;
    const bool several = surface.split[vp] != 0 || surface.split[vq] != 0;
    const bool fixed_p = surface.locked[vp] != 0;
    const bool fixed_q = surface.locked[vq] != 0;
    VertexQuadric &p = work.quadrics.vertices[vp];
    const VertexQuadric &q = work.quadrics.vertices[vq];
    const WedgeSets sets = match_wedges(surface, h);
    if (several) {
        carry(work, work.ring_p, sets, p.at, at);
        carry(work, work.ring_q, sets, q.at, at);
    }
    merge(work, sets, p, q, at, fixed_p, fixed_q);
    if (fixed_q) {
        surface.source_place[vp] = surface.source_place[vq];
    }
    p.at = at;
    surface.locked[vp] |= surface.locked[vq];
    surface.border[vp] |= surface.border[vq];
    for (const std::uint32_t i : work.ring_q) {
        surface.at(i).vertex = vp;
    }
    // A half-edge that leaves p and lives on; the triangles' tips need none, edges hold theirs.
    std::uint32_t start = none;
    for (const std::uint32_t side : {h, t}) {
        if (side == none) {
            continue;
        }
        const std::uint32_t a = surface.at(next(side)).twin;
        const std::uint32_t b = surface.at(previous(side)).twin;
        // For h, b runs from p to the tip; for its twin, a does not: b runs from q to the tip.
        start = b != none ? b : next(a);
    }
    close(work, h);
    if (t != none) {
        close(work, t);
    }
    work.state[surface.at(h).edge] = dead;
    refresh(work, start, vp, several, fixed_p || fixed_q, bucket);
}

} // namespace paradize::simplify
