// Ambient occlusion by brute force: of each point every triangle is laid over a fine grid of directions, in
// double, without a tree and without rays of a stage.
// Source: W. Nusselt, "Graphische Bestimmung des Winkelverhaeltnisses bei der Waermestrahlung", 1928: what
// covers a share of the unit disk below the hemisphere hides that share of the cosine-weighted light.
#pragma once

#include <cstddef>
#include <span>

namespace paradize::reference {

// points, normals, faces: (k, 3); normals and faces unit. corners: (m, 9), of the triangles that hold light
// back. reach: beyond it nothing does. cells: of the grid across the disk. out: (k,), the share of the cells
// above the face that no triangle covers; 1 where none is above it.
void open_shares(std::span<const double> points, std::span<const double> normals,
                 std::span<const double> faces, std::span<const double> corners, double reach,
                 std::size_t cells, std::span<double> out, int threads);

} // namespace paradize::reference
