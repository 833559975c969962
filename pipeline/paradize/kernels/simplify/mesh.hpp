// Triangles joined along edges, cut open where they are not a surface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "simplify/pages.hpp"

namespace paradize::simplify {

inline constexpr std::uint32_t none = 0xffffffffu;

// A corner of a triangle, and the half-edge from its vertex to the next corner's.
struct Half {
    std::uint32_t vertex;
    std::uint32_t wedge;
    std::uint32_t twin; // the half-edge that runs the other way, or none
    std::uint32_t edge; // number of the edge
};

// A triangle is one cache line: half-edges 4 t, 4 t + 1 and 4 t + 2, and beside them its source.
struct alignas(64) Triangle {
    Half half[3];
    std::uint32_t source; // source triangle
    std::uint32_t alive;
    std::uint32_t spare[2];
};

inline std::uint32_t next(std::uint32_t h) {
    return (h & 3) == 2 ? h - 2 : h + 1;
}
inline std::uint32_t previous(std::uint32_t h) {
    return (h & 3) == 0 ? h + 2 : h - 1;
}
inline std::uint32_t triangle_of(std::uint32_t h) {
    return h >> 2;
}

// A vertex is a place with one fan of triangles around it: where several fans meet in one place, or an edge
// has three triangles or two that run along it the same way, each fan is a vertex of its own and all of them
// are locked, so that nothing comes apart. A wedge is what a fan's corners of one source vertex and one group
// share; a vertex has several on seams.
struct Surface {
    Array<Triangle> triangle;
    Array<std::uint32_t> half;               // (edges) a half-edge of it
    std::vector<std::uint32_t> source;       // (wedges) its source vertex
    std::vector<std::uint32_t> first;        // (vertices) a half-edge that leaves it, at first
    std::vector<std::uint32_t> component;    // (vertices) the component it belongs to
    std::vector<std::uint32_t> source_place; // (vertices) its source place
    std::vector<std::uint8_t> locked;        // (vertices)
    std::vector<std::uint8_t> border;        // (vertices) 1 where an edge of one triangle ends
    std::vector<std::uint8_t> split;         // (vertices) 1 where it has several wedges
    std::uint32_t components = 0;

    std::uint32_t vertices() const { return static_cast<std::uint32_t>(first.size()); }
    std::uint32_t wedges() const { return static_cast<std::uint32_t>(source.size()); }
    std::uint32_t edges() const { return static_cast<std::uint32_t>(half.size()); }
    std::uint32_t triangles() const { return static_cast<std::uint32_t>(triangle.size()); }
    Half &at(std::uint32_t h) { return triangle[h >> 2].half[h & 3]; }
    const Half &at(std::uint32_t h) const { return triangle[h >> 2].half[h & 3]; }
};

// Calls visit(h) for the half-edge of every triangle that leaves the vertex of half-edge `start`.
template <typename Visit>
void around(const Surface &surface, std::uint32_t start, Visit &&visit) {
    std::uint32_t h = start;
    do {
        visit(h);
        h = surface.at(previous(h)).twin;
    } while (h != start && h != none);
    if (h == none) {
        for (h = surface.at(start).twin; h != none; h = surface.at(h).twin) {
            h = next(h);
            visit(h);
        }
    }
}

// triangles: (m, 3) indices below place.size(). place: of each source vertex, numbers below place.size();
// vertices of one place have one position. group: (m) of each triangle. Triangles that name a place
// twice are left out.
Surface build_surface(std::span<const std::uint32_t> triangles, std::span<const std::uint32_t> place,
                      std::span<const std::uint32_t> group);

} // namespace paradize::simplify
