// Charts laid side by side into a square of texels.
// Source of the idea (rows of free runs, lowest place first): B. Levy, S. Petitjean, N. Ray and J. Maillot,
// "Least squares conformal maps for automatic texture atlas generation", 2002, section 4.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace paradize::atlas {

struct Packed {
    std::vector<double> corners; // (m, 3, 2) texels, x to the right, y up, all inside the square
    double texels_per_unit = 0;  // of the corners that came in
};

// More charts than this do not fit, however small they are.
std::int32_t most_charts(std::uint32_t resolution, std::uint32_t padding);

// corners: (m, 3, 2) in one unit; chart: (m), 0 to count - 1, none empty. resolution: texels of the square's
// side, 16 or more; padding: texels that stay free between two charts, and half as many along the square's
// border. Charts are moved, turned by quarters and scaled alike, never mirrored. Returns no corners where
// they do not fit however small they are.
Packed pack(std::span<const double> corners, std::span<const std::int32_t> chart, std::int32_t count,
            std::uint32_t resolution, std::uint32_t padding);

} // namespace paradize::atlas
