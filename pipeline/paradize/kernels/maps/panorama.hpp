// Faces of a cube map out of a panorama: each texel is the mean of the light of the solid angle that it
// covers.
#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace paradize::maps {

// Light (rows, columns, 3) of all directions: columns go from south over west, north (-Z, the middle) and
// east
// (+X) back to south, rows from straight up (+Y) to straight down. Places between texels are mixed of four.
struct Panorama {
    std::span<const float> light;
    std::size_t rows;
    std::size_t columns;
};

// A face of a cube map: (size, size) texels. The direction of a place s to the right and t downwards, each -1
// to 1, is middle + s * right + t * down, as OpenGL 3.3 has them (chapter 3.8.6).
struct CubeFace {
    std::array<double, 3> middle, right, down;
    std::size_t size;
};

// out: (size, size, 3). Each texel is the mean of spots * spots places, weighted by their solid angle.
void cut_face(const Panorama &panorama, const CubeFace &face, std::size_t spots, std::span<float> out,
              int threads);

} // namespace paradize::maps
