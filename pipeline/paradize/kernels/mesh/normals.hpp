// Corner normals by smoothing group and crease angle, weighted by the angle of each face at the corner.
// Source: G. Thürmer and C. Wüthrich, "Computing vertex normals from polygonal facets", 1998.
#pragma once

#include <cstdint>
#include <span>

namespace paradize::mesh {

inline constexpr std::uint32_t unknown_smoothing = 0xffffffffu;

// positions: (n, 3) metres, finite. places: (n,) number of each vertex's position (equal positions share
// one). triangles: (m, 3). smoothing: (m,) 0 = flat, unknown_smoothing = smooth where faces meet at
// crease_deg or less, any other = smooth among faces of the same group. crease_deg: 0 to 180. out: (m, 3, 3)
// unit normal of every corner; (0, 0, 1) where a face and all its neighbours have no area.
void corner_normals(std::span<const float> positions, std::span<const std::uint32_t> places,
                    std::span<const std::uint32_t> triangles, std::span<const std::uint32_t> smoothing,
                    double crease_deg, std::span<float> out);

} // namespace paradize::mesh
