// How far the places of a mesh are from where it is rooted, along its surface.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace paradize::mesh {

// from_root: of each place, along edges, and over gaps where a part hangs on another; metres. in_branch: the
// same from where its branch begins, as a share of the branch's longest; 0 in parts that are rooted.
struct RootDistances {
    std::vector<double> from_root;
    std::vector<double> in_branch;
};

// places: (n, 3), all different. triangles: (m, 3) indices of places. A part is what triangles connect. Those
// with a place in the lowest `rooted` (0 to 1) of the height stand by themselves. Every other hangs where it
// comes nearest to what stands or hangs already: parts are joined to their nearest neighbours, in rounds,
// until all hang together (O. Boruvka, "O jistem problemu minimalnim", 1926). A branch is all that hangs on a
// rooted part by one such place. Distances are those of E. W. Dijkstra, "A note on two problems in connexion
// with graphs", 1959. A place that no triangle has is a part of its own.
RootDistances reach(std::span<const float> places, std::span<const std::uint32_t> triangles, double rooted);

} // namespace paradize::mesh
