#include "simplify/mesh.hpp"

#include <utility>

#include "math/disjoint_sets.hpp"

namespace paradize::simplify {

namespace {

using Numbers = std::vector<std::uint32_t>;

// Half-edges by the place that they leave, each with the place that it runs to.
struct OutgoingEdges {
    struct Edge {
        std::uint32_t to;
        std::uint32_t half;
    };
    Numbers first;
    Array<Edge> list;

    OutgoingEdges(const Surface &surface, std::size_t places)
        : first(places + 1), list(3 * surface.triangle.size()) {
        for (const Triangle &triangle : surface.triangle) {
            for (const Half &half : triangle.half) {
                ++first[half.vertex + 1];
            }
        }
        for (std::size_t i = 0; i < places; ++i) {
            first[i + 1] += first[i];
        }
        Numbers at(first.begin(), first.end() - 1);
        for (std::uint32_t t = 0; t < surface.triangles(); ++t) {
            for (std::uint32_t h = 4 * t; h < 4 * t + 3; ++h) {
                list[at[surface.at(h).vertex]++] = {surface.at(next(h)).vertex, h};
            }
        }
    }
};

// Twins of edges with exactly one triangle on each side; places of all other edges but borders are
// locked_places. The halves' vertices are places still.
void find_twins(Surface &surface, std::size_t places, std::vector<std::uint8_t> &locked_places) {
    const OutgoingEdges outgoing(surface, places);
    const auto count = [&](std::uint32_t from, std::uint32_t to, std::uint32_t &found) {
        std::uint32_t number = 0;
        for (std::uint32_t i = outgoing.first[from]; i < outgoing.first[from + 1]; ++i) {
            if (outgoing.list[i].to == to) {
                found = outgoing.list[i].half;
                ++number;
            }
        }
        return number;
    };
    for (std::uint32_t t = 0; t < surface.triangles(); ++t) {
        for (std::uint32_t h = 4 * t; h < 4 * t + 3; ++h) {
            if (surface.at(h).twin != none) {
                continue;
            }
            const std::uint32_t from = surface.at(h).vertex;
            const std::uint32_t to = surface.at(next(h)).vertex;
            std::uint32_t same = none;
            std::uint32_t other = none;
            const std::uint32_t along = count(from, to, same);
            const std::uint32_t against = count(to, from, other);
            if (along == 1 && against == 1) {
                surface.at(h).twin = other;
                surface.at(other).twin = h;
            } else if (along > 1 || against > 1) {
                locked_places[from] = locked_places[to] = 1;
            }
        }
    }
}

void number_components(Surface &surface) {
    DisjointSets parts(surface.vertices());
    for (std::uint32_t t = 0; t < surface.triangles(); ++t) {
        for (std::uint32_t k = 1; k < 3; ++k) {
            parts.join(surface.at(4 * t).vertex, surface.at(4 * t + k).vertex);
        }
    }
    surface.component.resize(surface.vertices());
    for (std::uint32_t v = 0; v < surface.vertices(); ++v) {
        const std::uint32_t r = parts.root(v);
        surface.component[v] = r == v ? surface.components++ : surface.component[r];
    }
}

// Vertices and wedges, in order of their first corners; places of several vertices are locked.
void number_fans(Surface &surface, std::span<const std::uint32_t> triangles,
                 std::span<const std::uint32_t> group, std::size_t places,
                 std::vector<std::uint8_t> &locked_places) {
    Numbers first(places, none); // vertex of a place
    std::vector<std::pair<std::uint64_t, std::uint32_t>> wedges;
    for (std::uint32_t start = 0; start < 4 * surface.triangles(); ++start) {
        if ((start & 3) == 3 || surface.at(start).wedge != none) {
            continue;
        }
        const std::uint32_t v = surface.vertices();
        const std::uint32_t source_place = surface.at(start).vertex;
        surface.first.push_back(start);
        surface.source_place.push_back(source_place);
        if (first[source_place] == none) {
            first[source_place] = v;
        } else {
            locked_places[source_place] = 1;
        }
        wedges.clear();
        std::uint8_t border = 0;
        around(surface, start, [&](std::uint32_t h) {
            Half &half = surface.at(h);
            half.vertex = v;
            border |= half.twin == none || surface.at(previous(h)).twin == none;
            const std::uint32_t t = surface.triangle[triangle_of(h)].source;
            const std::uint32_t from = triangles[3 * t + (h & 3)];
            const std::uint64_t key = std::uint64_t{group[t]} << 32 | from;
            for (const auto &[known, number] : wedges) {
                if (known == key) {
                    half.wedge = number;
                    return;
                }
            }
            half.wedge = surface.wedges();
            surface.source.push_back(from);
            wedges.emplace_back(key, half.wedge);
        });
        surface.border.push_back(border);
        surface.split.push_back(wedges.size() > 1);
    }
}

} // namespace

Surface build_surface(std::span<const std::uint32_t> triangles, std::span<const std::uint32_t> place,
                      std::span<const std::uint32_t> group) {
    Surface surface;
    const std::size_t count = triangles.size() / 3;
    surface.triangle.reserve(count);
    for (std::uint32_t t = 0; t < count; ++t) {
        const std::uint32_t a = place[triangles[3 * t]];
        const std::uint32_t b = place[triangles[3 * t + 1]];
        const std::uint32_t c = place[triangles[3 * t + 2]];
        if (a != b && b != c && c != a) {
            const auto half = [](std::uint32_t at) { return Half{at, none, none, none}; };
            surface.triangle.push_back({{half(a), half(b), half(c)}, t, 1, {}});
        }
    }
    std::vector<std::uint8_t> locked_places(place.size());
    find_twins(surface, place.size(), locked_places);
    number_fans(surface, triangles, group, place.size(), locked_places);
    for (const std::uint32_t source_place : surface.source_place) {
        surface.locked.push_back(locked_places[source_place]);
    }
    surface.half.reserve(2 * count);
    for (std::uint32_t t = 0; t < surface.triangles(); ++t) {
        for (std::uint32_t h = 4 * t; h < 4 * t + 3; ++h) {
            Half &half = surface.at(h);
            if (half.edge == none) {
                half.edge = surface.edges();
                if (half.twin != none) {
                    surface.at(half.twin).edge = half.edge;
                }
                surface.half.push_back(h);
            }
        }
    }
    number_components(surface);
    return surface;
}

} // namespace paradize::simplify
