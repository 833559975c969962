// Which places of a surface the texels of a map show.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace paradize::occlusion {

// One for each texel and triangle that shows there, in the order of the triangles.
struct Places {
    std::vector<std::uint32_t> texel, triangle; // flat index; number
    std::vector<double> weights;                // (n, 3), of the corners: 0..1, their sum is 1
    std::size_t shared = 0;                     // texels inside two triangles or more, not only at their edge
};

// uvs: (n, 2), top-left, of any tile. touched: (rows, columns), the triangle that covers a part of the texel,
// -1: none. A texel shows each triangle that its centre lies in; without one, the nearest point of the
// triangle that touches it. Throws std::length_error for more than `most` places.
Places places_of(std::span<const float> uvs, std::span<const std::uint32_t> triangles,
                 std::span<const std::int32_t> touched, std::size_t rows, std::size_t columns,
                 std::size_t most);

} // namespace paradize::occlusion
