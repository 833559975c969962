// Tangent frames as MikkTSpace makes them: same split rules, same weights.
// Source: M. Mikkelsen, "Simulation of Wrinkled Surfaces Revisited", master's thesis, University of
// Copenhagen, 2008.
#pragma once

#include <cstdint>
#include <span>

namespace paradize::mesh {

// positions: (n, 3) metres; normals: (n, 3) unit; uvs: (n, 2) top-left origin; all finite. triangles: (m, 3).
// out: (m, 3, 4) tangent of every corner: xyz unit and at right angles to the normal, w = +-1 so that
// w * cross(N, T) points up the image. Corners whose triangles have no area in the image (or in space) take
// the frame of a neighbour, or any unit vector at right angles to the normal with w = 1.
void corner_tangents(std::span<const float> positions, std::span<const float> normals,
                     std::span<const float> uvs, std::span<const std::uint32_t> triangles,
                     std::span<float> out);

} // namespace paradize::mesh
