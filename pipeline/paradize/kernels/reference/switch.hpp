// How much of the picture changes when a renderer replaces one level of a mesh by the next. For metrics only.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "reference/seen.hpp"

namespace paradize::reference {

// How both levels are drawn. background: the code of sRGB behind them, a grey. samples: along a pixel.
struct SwitchPictures {
    SeenLight light;
    std::uint8_t background = 0;
    std::size_t samples = 2;
};

// Of each of `directions` (towards the viewer): the mean of FLIP (flip.hpp) over the pixels around the
// bounding box of `before`, in pictures with pixels of `pixel` (> 0, unit of the positions), in codes of 8
// bits.
std::vector<double> switch_flips(const SeenMesh &before, const SeenMesh &after,
                                 std::span<const double> directions, double pixel, const SwitchPictures &how,
                                 int threads);

} // namespace paradize::reference
