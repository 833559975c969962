// OpenMesh behind our arrays: a second count of a surface's edges, and its simplifier.
//
// OpenMesh holds manifolds only, and crashes on indices that are out of range: openmesh checks them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace paradize::openmesh {

struct Counts {
    std::size_t faces = 0;  // that OpenMesh took: fewer than there are where the surface is no manifold
    std::size_t edges = 0;  // all
    std::size_t border = 0; // edges of one triangle
};

Counts count(std::span<const double> positions, std::span<const std::uint32_t> triangles);

struct Simplified {
    std::vector<std::uint32_t> vertex;    // of each vertex that is left: its number in the source; none moves
    std::vector<std::uint32_t> triangles; // indices into `vertex`
};

// Collapses edges into one of their ends, the least quadric error first (Garland and Heckbert 1997), until
// `target` triangles are left or no collapse is allowed. A collapse that turns a triangle over is not.
// Throws std::invalid_argument where OpenMesh cannot hold the surface.
Simplified simplify(std::span<const double> positions, std::span<const std::uint32_t> triangles,
                    std::size_t target);

} // namespace paradize::openmesh
