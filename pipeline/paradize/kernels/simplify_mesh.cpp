#include "simplify_mesh.hpp"

#include <utility>

namespace paradize::simplify {

namespace {

using Numbers = std::vector<std::uint32_t>;

// Half-edges by the place that they leave.
struct Leaving {
    Numbers first;
    Numbers list;

    Leaving(const Numbers &corner_place, std::size_t places) : first(places + 1), list(corner_place.size()) {
        for (const std::uint32_t place : corner_place) {
            ++first[place + 1];
        }
        for (std::size_t i = 0; i < places; ++i) {
            first[i + 1] += first[i];
        }
        Numbers at(first.begin(), first.end() - 1);
        for (std::uint32_t h = 0; h < corner_place.size(); ++h) {
            list[at[corner_place[h]]++] = h;
        }
    }
};

// Twins of edges with exactly one triangle on each side; places of all other edges but borders are held.
void find_twins(Surface &surface, const Numbers &at, std::size_t places, std::vector<std::uint8_t> &held) {
    const Leaving leaving(at, places);
    surface.twin.assign(at.size(), none);
    const auto count = [&](std::uint32_t from, std::uint32_t to, std::uint32_t &found) {
        std::uint32_t number = 0;
        for (std::uint32_t i = leaving.first[from]; i < leaving.first[from + 1]; ++i) {
            if (at[next(leaving.list[i])] == to) {
                found = leaving.list[i];
                ++number;
            }
        }
        return number;
    };
    for (std::uint32_t h = 0; h < at.size(); ++h) {
        const std::uint32_t from = at[h];
        const std::uint32_t to = at[next(h)];
        if (surface.twin[h] != none) {
            continue;
        }
        std::uint32_t same = none;
        std::uint32_t other = none;
        const std::uint32_t along = count(from, to, same);
        const std::uint32_t against = count(to, from, other);
        if (along == 1 && against == 1) {
            surface.twin[h] = other;
            surface.twin[other] = h;
        } else if (along > 1 || against > 1) {
            held[from] = held[to] = 1;
        }
    }
}

std::uint32_t root(Numbers &parent, std::uint32_t v) {
    while (parent[v] != v) {
        parent[v] = parent[parent[v]];
        v = parent[v];
    }
    return v;
}

void number_parts(Surface &surface) {
    Numbers parent(surface.vertices());
    for (std::uint32_t v = 0; v < parent.size(); ++v) {
        parent[v] = v;
    }
    for (std::uint32_t t = 0; t < surface.triangles(); ++t) {
        for (std::uint32_t k = 1; k < 3; ++k) {
            const std::uint32_t a = root(parent, surface.vertex[3 * t]);
            const std::uint32_t b = root(parent, surface.vertex[3 * t + k]);
            parent[a < b ? b : a] = a < b ? a : b;
        }
    }
    surface.part.resize(parent.size());
    for (std::uint32_t v = 0; v < parent.size(); ++v) {
        const std::uint32_t r = root(parent, v);
        surface.part[v] = r == v ? surface.parts++ : surface.part[r];
    }
}

} // namespace

Surface join(std::span<const std::uint32_t> triangles, std::span<const std::uint32_t> place,
             std::span<const std::uint32_t> group, std::span<const std::uint8_t> locked) {
    Surface surface;
    Numbers at;
    const std::size_t count = triangles.size() / 3;
    at.reserve(3 * count);
    for (std::uint32_t t = 0; t < count; ++t) {
        const std::uint32_t a = place[triangles[3 * t]];
        const std::uint32_t b = place[triangles[3 * t + 1]];
        const std::uint32_t c = place[triangles[3 * t + 2]];
        if (a != b && b != c && c != a) {
            at.insert(at.end(), {a, b, c});
            surface.triangle.push_back(t);
        }
    }
    std::vector<std::uint8_t> held(place.size());
    find_twins(surface, at, place.size(), held);
    for (std::size_t i = 0; i < locked.size(); ++i) {
        held[place[i]] |= locked[i] != 0;
    }

    surface.vertex.assign(at.size(), none);
    surface.wedge.assign(at.size(), none);
    Numbers first(place.size(), none); // vertex of a place
    std::vector<std::pair<std::uint64_t, std::uint32_t>> wedges;
    for (std::uint32_t h = 0; h < at.size(); ++h) {
        if (surface.vertex[h] != none) {
            continue;
        }
        const std::uint32_t v = surface.vertices();
        surface.leaving.push_back(h);
        surface.border.push_back(0);
        surface.home.push_back(at[h]);
        if (first[at[h]] == none) {
            first[at[h]] = v;
        } else {
            held[at[h]] = 1;
        }
        wedges.clear();
        around(surface, h, [&](std::uint32_t i) {
            surface.vertex[i] = v;
            surface.border[v] |= surface.twin[i] == none || surface.twin[previous(i)] == none;
            const std::uint32_t t = surface.triangle[i / 3];
            const std::uint32_t from = triangles[3 * t + i % 3];
            const std::uint64_t key = std::uint64_t{group[t]} << 32 | from;
            for (const auto &[known, number] : wedges) {
                if (known == key) {
                    surface.wedge[i] = number;
                    return;
                }
            }
            surface.wedge[i] = surface.wedges();
            surface.source.push_back(from);
            wedges.emplace_back(key, surface.wedge[i]);
        });
        surface.split.push_back(wedges.size() > 1);
    }
    surface.locked.assign(surface.vertices(), 0);
    surface.edge.assign(at.size(), none);
    for (std::uint32_t h = 0; h < at.size(); ++h) {
        surface.locked[surface.vertex[h]] = held[at[h]];
        if (surface.edge[h] == none) {
            surface.edge[h] = surface.edges();
            if (surface.twin[h] != none) {
                surface.edge[surface.twin[h]] = surface.edges();
            }
            surface.half.push_back(h);
        }
    }
    number_parts(surface);
    return surface;
}

} // namespace paradize::simplify
