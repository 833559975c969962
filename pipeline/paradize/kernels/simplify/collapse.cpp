#include "simplify/collapse.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "simplify/work.hpp"

namespace paradize::simplify {

namespace {

inline void fetch(const void *address) {
    __builtin_prefetch(address);
}

// Of the edges that come next, what they will be tried with: memory is far.
void fetch_ahead(const Work &work) {
    const Surface &surface = work.surface;
    const std::uint32_t third = work.queue.ahead(24);
    fetch(&work.state[third]);
    fetch(&surface.half[third]);
    fetch(&surface.at(surface.half[work.queue.ahead(16)]));
    const std::uint32_t first = surface.half[work.queue.ahead(8)];
    for (const std::uint32_t i : {first, next(first)}) {
        const Half &half = surface.at(i);
        const VertexQuadric &corner = work.quadrics.vertices[half.vertex];
        fetch(&corner);
        fetch(&corner.at);
        if (work.quadrics.weighed) {
            const Float4 *wedge = work.quadrics.wedge(half.wedge);
            for (std::size_t k = 0; k < work.quadrics.stride; k += 4) {
                fetch(wedge + k);
            }
        }
    }
}

void measure_components(Work &work) {
    if (work.limits.kept_area <= 0) {
        return;
    }
    const Surface &surface = work.surface;
    work.component_area.assign(surface.components, 0.0);
    for (const Triangle &triangle : surface.triangle) {
        const Vec a = work.quadrics.vertices[triangle.half[0].vertex].at;
        const Vec b = work.quadrics.vertices[triangle.half[1].vertex].at;
        const Vec c = work.quadrics.vertices[triangle.half[2].vertex].at;
        work.component_area[surface.component[triangle.half[0].vertex]] += length(cross(b - a, c - a));
    }
    for (const double area : work.component_area) {
        work.component_least_area.push_back(work.limits.kept_area * area);
    }
}

std::uint32_t cost_bucket(const Work &work, std::uint32_t e) {
    return Queue::bucket(optimal_placement(work.surface, work.quadrics, work.surface.half[e], false).cost);
}

void requeue_parked(Work &work) {
    for (std::uint32_t e = 0; e < work.surface.edges(); ++e) {
        if (work.state[e] == parked) {
            work.state[e] = queued;
            work.queue.push(e, cost_bucket(work, e));
        }
    }
}

// Collapses the edge, queues it again where it costs more than its bucket by now, or parks it.
void try_edge(Work &work, std::uint32_t e, std::uint32_t bucket) {
    const std::uint32_t h = work.surface.half[e];
    const Placement placement = optimal_placement(work.surface, work.quadrics, h, work.quadrics.weighed);
    const std::uint32_t now = Queue::bucket(placement.cost);
    if (now > bucket) {
        work.queue.push(e, now);
        return;
    }
    work.ring_p.clear();
    work.ring_q.clear();
    around(work.surface, h, [&](std::uint32_t i) { work.ring_p.push_back(i); });
    around(work.surface, next(h), [&](std::uint32_t i) { work.ring_q.push_back(i); });
    if (!allowed(work, h, placement.at)) {
        work.state[e] = parked;
        return;
    }
    collapse(work, h, placement.at, bucket);
}

// Tries the cheapest edge again and again, until the target is reached or no edge may collapse.
Stop reduce(Work &work) {
    std::size_t before = work.left + 1;
    while (work.left > work.limits.target) {
        std::uint32_t bucket = 0;
        const std::uint32_t e = work.queue.pop(bucket);
        if (e == none) {
            if (work.left == before) {
                return Stop::nothing;
            }
            before = work.left;
            requeue_parked(work);
            continue;
        }
        fetch_ahead(work);
        if (work.state[e] != dead) {
            try_edge(work, e, bucket);
        }
    }
    return Stop::target;
}

} // namespace

Result simplify(const Input &input, const Limits &limits) {
    Surface surface = build_surface(input.triangles, input.place, input.group);
    Quadrics quadrics = initial_quadrics(input, surface);
    Work work{input, limits, std::move(surface), std::move(quadrics)};
    work.state.assign(work.surface.edges(), queued);
    work.seen.assign(work.surface.vertices(), 0);
    work.left = work.surface.triangles();
    measure_components(work);
    for (std::uint32_t e = 0; e < work.surface.edges(); ++e) {
        work.queue.push(e, cost_bucket(work, e));
    }
    Result result;
    result.stop = reduce(work);
    write(work, result);
    return result;
}

} // namespace paradize::simplify
