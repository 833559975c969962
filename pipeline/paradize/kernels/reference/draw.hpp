// Counts the work of a graphics card that draws triangles in the order given: vertices transformed, bytes
// fetched. For metrics only: no stage uses this kernel.
// Sources: H. Hoppe, "Optimization of mesh locality for transparent vertex caching", 1999 (ACMR);
// P. Sander, D. Nehab and J. Barczak, "Fast triangle reordering for vertex locality and reduced overdraw",
// 2007 (ATVR).
#pragma once

#include <cstdint>
#include <span>

namespace paradize::reference {

struct DrawCost {
    double acmr = 0;      // vertices transformed per triangle: 0.5 at best on a large mesh, 3 at worst
    double atvr = 0;      // transforms per vertex that is used at all: 1 at best
    double overfetch = 0; // bytes read from memory per byte of the vertices that are used: 1 at best
};

// The vertex cache is first in, first out, of `cache` vertices (1 or more). Vertices lie in one tight array
// per stream; `strides` holds their bytes (1 or more each). Memory is read in lines of 64 bytes through a
// first-in, first-out cache of `lines` lines that all streams share. indices: each below `vertices`; a whole
// number of triangles.
DrawCost draw_cost(std::span<const std::uint32_t> indices, std::size_t vertices, unsigned cache,
                   std::span<const std::uint32_t> strides, std::uint64_t lines);

} // namespace paradize::reference
