// Tangent frames as MikkTSpace makes them: same split rules, same weights.
// Source: M. Mikkelsen, "Simulation of Wrinkled Surfaces Revisited", master's thesis, University of
// Copenhagen, 2008.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace paradize::mesh {

// positions: (n, 3) metres; normals: (n, 3) unit; uvs: (n, 2) top-left origin; all finite. triangles: (m, 3).
struct Surface {
    std::span<const float> positions, normals, uvs;
    std::span<const std::uint32_t> triangles;
};

// xyz unit and at right angles to the normal, w = +-1 so that w * cross(N, T) points up the image.
struct Frame {
    float x = 0, y = 0, z = 0, w = 1;
    bool operator==(const Frame &) const = default;
};

// vertex: the mean at each vertex; mikktspace: by the thesis's rules.
enum class Method { vertex, mikktspace };

// The frame of every corner, as an indexed mesh: index (m, 3) of each corner; source: the vertex that each
// new one was; a vertex is split where its corners' frames differ. New ones are numbered in the order of
// their first use. Corners whose triangles have no area in the image (or in space) take the frame of a
// neighbour, or any unit vector at right angles to the normal with w = 1. The bytes do not depend on
// `threads`.
struct SplitTangents {
    std::vector<std::uint32_t> index, source;
    std::vector<Frame> frames;
};
SplitTangents split_tangents(const Surface &surface, Method method, int threads);

} // namespace paradize::mesh
