// Edges, borders, components of an indexed triangle mesh.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace paradize::mesh {

inline constexpr std::uint32_t nowhere = 0xffffffffu;

// A kind of edge or vertex: how many, and a triangle where the first one is.
struct Occurrences {
    std::uint64_t count = 0;
    std::uint32_t first_triangle = nowhere;
};

struct Topology {
    std::uint64_t edges = 0;
    Occurrences border;       // edges of one triangle
    Occurrences non_manifold; // edges of three or more
    Occurrences turned;       // edges that two triangles run along the same way: their windings disagree
    Occurrences bow_tie;      // vertices where fans of triangles touch without a shared edge
    std::uint32_t components = 0;
    std::vector<std::uint32_t> component; // of each triangle, numbered in order of first use
    std::vector<std::uint32_t> island;    // of each vertex: parts joined by a vertex at least
};

// triangles: (m, 3) indices below `vertices`, no index twice in a triangle. Triangles that share an edge,
// whatever its direction and however many there are, belong to one component.
Topology topology(std::span<const std::uint32_t> triangles, std::uint32_t vertices);

} // namespace paradize::mesh
