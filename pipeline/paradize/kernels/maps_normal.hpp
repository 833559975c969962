// Tangent-space normals of a height field, green up: n = (-dh/dx, dh/drow, 1) / |.|.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace paradize::maps {

// How a slope is taken from its neighbours.
//   central: (h[+1] - h[-1]) / 2, second order
//   scharr:  the same, smoothed across by 3 10 3 (H. Scharr, "Optimale Operatoren in der digitalen
//   Bildverarbeitung", 2000) fourth:  (8 (h[+1] - h[-1]) - (h[+2] - h[-2])) / 12, fourth order
enum class Filter { central = 0, scharr = 1, fourth = 2 };

struct NormalSettings {
    double scale_x = 1.0; // slope of one unit of height from one texel to the next, along the rows
    double scale_y = 1.0; // the same, along the columns
    Filter filter = Filter::fourth;
    bool wrap_x = false; // the left edge continues at the right one; else the height goes on as it came (odd
                         // reflection)
    bool wrap_y = false;
    bool green_down = false;
};

// heights: rows * columns, finite. islands: empty, or one id per texel, negative outside: taps never leave a
// texel's island, and a slope whose taps all left it is zero. normals: rows * columns * 3, unit; where the
// taps are equal exactly (0, 0, 1). Correct for slopes up to 1e300 (a steep map is computed in double).
void normals_from_heights(std::span<const float> heights, std::size_t rows, std::size_t columns,
                          std::span<const std::int32_t> islands, const NormalSettings &settings,
                          std::span<float> normals, int threads);

} // namespace paradize::maps
