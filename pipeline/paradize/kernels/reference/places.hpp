// Compares a surface with another at the nearest places: the angle between their mapped normals, and how far
// a texture slid. For metrics only: no stage uses this kernel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "reference/tree.hpp"

namespace paradize::reference {

// Vertices may be split where a tree's are not: the triangles are the same, in their order.
struct Shading {
    std::span<const std::uint32_t> triangles; // (m, 3)
    std::span<const float> normals;           // (n, 3) unit, by vertex
    std::span<const float> tangents;          // (n, 4), w = +-1, or empty
    std::span<const float> uvs;               // (n, 2), top-left origin, or empty
};

enum class Wrap { repeat, clamp, mirror };

// A normal map: (rows, columns, 3) unit vectors, green up; sampled bilinearly at texel centres.
struct NormalMap {
    std::span<const float> vectors;
    std::size_t rows = 0, columns = 0;
    Wrap across = Wrap::repeat, down = Wrap::repeat; // beyond its edges
};

struct Spread {
    double mean = 0, p99 = 0, max = 0; // over area
};

// Degrees between the normals that `from` and `to` show at the same place, over the samples of `from`. The
// same place: the nearest one of `to` whose triangle faces the same way, if it is no farther than twice the
// nearest one of all plus `near`; else the nearest of all. Normals are interpolated and made unit: `plain`;
// with a map and tangents on both they are turned by the map too, x T + y B + z N, B = w cross(N, T):
// `mapped`, else the same as `plain`. Samples: at least four in every triangle.
struct Angles {
    Spread plain, mapped;
};
Angles normal_angles(const Tree &from, const Shading &seen, const Tree &to, const Shading &truth,
                     const NormalMap &map, double near, std::uint64_t samples, unsigned threads);

// How far, in the positions' unit, the texture that `from` shows lies from where `to` shows it: the least
// distance from a sample to a place of `to`, where what is missing there in texture coordinates counts `unit`
// a piece: to a place that shows the same, or, where the image is next to a point (palettes), to any.
// Samples: about `samples` in all, one in every triangle at least up to that number.
Spread uv_shift(const Tree &from, const Shading &seen, const Tree &to, const Shading &truth, double unit,
                std::uint64_t samples, unsigned threads);

} // namespace paradize::reference
