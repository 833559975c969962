#include "mesh/tangents/vertex.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "mesh/tangents/frame.hpp"

namespace paradize::mesh {
namespace {

struct Direction {
    Vec s; // unit direction of growing u, or zero without area
    bool preserves = false;
};

Direction direction_of(const Surface &surface, const std::uint32_t *triangle) {
    const Vec p0 = at3(surface.positions, triangle[0]);
    const Vec d1 = at3(surface.positions, triangle[1]) - p0, d2 = at3(surface.positions, triangle[2]) - p0;
    const auto uv = [&](std::size_t k, std::size_t c) {
        return static_cast<double>(surface.uvs[triangle[k] * std::size_t{2} + c]);
    };
    const double u1 = uv(1, 0) - uv(0, 0), v1 = uv(1, 1) - uv(0, 1);
    const double u2 = uv(2, 0) - uv(0, 0), v2 = uv(2, 1) - uv(0, 1);
    const double area = u1 * v2 - v1 * u2;
    if (area == 0)
        return {};
    return {unit((area > 0 ? 1.0 : -1.0) * (v2 * d1 - v1 * d2)), area > 0};
}

} // namespace

void vertex_tangents(const Surface &surface, std::span<Frame> out) {
    const std::size_t vertices = surface.positions.size() / 3;
    // Sums by handedness, not mirrored first; those of a vertex without any face of area stay zero.
    std::vector<std::array<Vec, 2>> sums(vertices);
    std::vector<Direction> faces(out.size() / 3);
    for (std::size_t f = 0; f < faces.size(); ++f) {
        const std::uint32_t *const triangle = &surface.triangles[f * 3];
        faces[f] = direction_of(surface, triangle);
        for (std::size_t k = 0; k < 3; ++k) {
            Vec &sum = sums[triangle[k]][faces[f].preserves ? 0 : 1];
            sum = sum + faces[f].s;
        }
    }
    std::vector<std::array<Frame, 2>> frames(vertices);
    for (std::size_t v = 0; v < vertices; ++v) {
        const Vec normal = unit(at3(surface.normals, v));
        for (const bool preserves : {true, false})
            frames[v][preserves ? 0 : 1] = frame_of(sums[v][preserves ? 0 : 1], normal, sign_of(preserves));
    }
    for (std::size_t c = 0; c < out.size(); ++c) {
        const Direction &face = faces[c / 3];
        const std::uint32_t vertex = surface.triangles[c];
        const bool first = face.s != Vec{} ? face.preserves : sums[vertex][0] != Vec{};
        out[c] = frames[vertex][first ? 0 : 1];
    }
}

} // namespace paradize::mesh
