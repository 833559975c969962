#include "mesh/topology.hpp"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "math/disjoint_sets.hpp"

namespace paradize::mesh {
namespace {

struct Side {
    std::uint32_t low, high, corner; // corner: triangle * 3 + side; the side runs from corner k to k + 1
};

void tell(Occurrences &found, std::uint32_t triangle) {
    ++found.count;
    found.first_triangle = std::min(found.first_triangle, triangle);
}

} // namespace

Topology topology(std::span<const std::uint32_t> triangles, std::uint32_t vertices) {
    const std::size_t corners = triangles.size();
    Topology out;
    const auto next = [](std::uint32_t c) { return c % 3 == 2 ? c - 2 : c + 1; };
    // By lower end first, which counting does, then by upper end and corner among the few that share it.
    std::vector<std::uint32_t> start(static_cast<std::size_t>(vertices) + 1, 0);
    for (std::uint32_t c = 0; c < corners; ++c)
        ++start[std::min(triangles[c], triangles[next(c)]) + 1];
    std::partial_sum(start.begin(), start.end(), start.begin());
    std::vector<Side> edges(corners);
    for (std::uint32_t c = 0; c < corners; ++c) {
        const std::uint32_t a = triangles[c], b = triangles[next(c)];
        edges[start[std::min(a, b)]++] = {std::min(a, b), std::max(a, b), c};
    }
    for (std::uint32_t v = 0, first = 0; v < vertices; first = start[v++])
        std::sort(edges.begin() + first, edges.begin() + start[v], [](const Side &a, const Side &b) {
            return std::tie(a.high, a.corner) < std::tie(b.high, b.corner);
        });
    DisjointSets faces(corners / 3), fans(corners);
    for (std::size_t i = 0; i < corners;) {
        std::size_t stop = i + 1;
        while (stop < corners && edges[stop].low == edges[i].low && edges[stop].high == edges[i].high)
            ++stop;
        ++out.edges;
        const std::uint32_t c = edges[i].corner;
        if (stop - i == 1) {
            tell(out.border, c / 3);
        } else if (stop - i > 2) {
            tell(out.non_manifold, c / 3);
        } else if (triangles[c] == triangles[edges[i + 1].corner]) {
            tell(out.turned, c / 3);
        }
        for (std::size_t j = i + 1; j < stop; ++j) {
            const std::uint32_t d = edges[j].corner;
            faces.join(c / 3, d / 3);
            const bool same = triangles[c] == triangles[d];
            fans.join(c, same ? d : next(d));
            fans.join(next(c), same ? next(d) : d);
        }
        i = stop;
    }
    out.component.resize(corners / 3);
    std::vector<std::uint32_t> number(corners / 3, nowhere);
    for (std::uint32_t f = 0; f < corners / 3; ++f) {
        std::uint32_t &here = number[faces.root(f)];
        if (here == nowhere)
            here = out.components++;
        out.component[f] = here;
    }
    DisjointSets parts(vertices);
    for (std::uint32_t c = 0; c < corners; ++c)
        parts.join(triangles[c], triangles[next(c)]);
    out.island.resize(vertices);
    for (std::uint32_t v = 0; v < vertices; ++v)
        out.island[v] = parts.root(v);
    std::vector<std::uint32_t> fan_of(vertices, nowhere);
    std::vector<std::uint8_t> counted(vertices, 0);
    for (std::uint32_t c = 0; c < corners; ++c) {
        const std::uint32_t v = triangles[c];
        const std::uint32_t fan = fans.root(c);
        if (fan_of[v] == nowhere)
            fan_of[v] = fan;
        else if (fan_of[v] != fan && !counted[v]) {
            tell(out.bow_tie, c / 3);
            counted[v] = 1;
        }
    }
    return out;
}

} // namespace paradize::mesh
