// How far tangent frames are from others, and whether they are frames at all. For metrics only.
#pragma once

#include <cstdint>
#include <span>

namespace paradize::reference {

// Angle in degrees, 0 to 180, between corresponding rows of two (n, 3) arrays of any length but zero, in
// float64 by atan2(|a x b|, a . b), exact near 0 and 180 degrees alike; 90 for a row without a direction.
void angles_deg(std::span<const float> a, std::span<const float> b, std::span<double> out);

// Tangent of every corner as MikkTSpace defines it, in float64 and face by face, for frames to be measured
// against; shares no step with kernels/mesh_tangents.
// Source: M. Mikkelsen, "Simulation of Wrinkled Surfaces Revisited", master's thesis, University of
// Copenhagen, 2008.
// positions: (n, 3); normals: (n, 3) unit; uvs: (n, 2) top-left origin; all finite. triangles: (m, 3).
// out: (m, 3, 4): xyz unit and at right angles to the normal, w = +-1 so that w * cross(N, T) points up the
// image. Corners whose triangles have no area in the image (or in space) take the frame of a neighbour, or
// any unit vector at right angles to the normal with w = 1.
void corner_tangents(std::span<const float> positions, std::span<const float> normals,
                     std::span<const float> uvs, std::span<const std::uint32_t> triangles,
                     std::span<float> out);

} // namespace paradize::reference
