// Measures how far float32 positions lie from the positions in a file's text. For metrics only.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace paradize::reference {

struct Loading {
    double max = 0; // the farthest that a vertex lies from its text, in the positions' unit
    std::array<double, 3> low{}, high{}; // box of the text's positions that triangles use
    std::size_t collapsed = 0;           // triangles with an area in the text and none as they were loaded
    std::uint32_t first = 0;             // of these
    double turned_p99_deg = 0;           // 99 % of the text's area was turned by no more
};

// positions: (n, 3) float32, counted from `origin`; texts: (n, 3) float64. triangles: (m, 3), m > 0. All
// finite. An area that the rounding of the text to float64 alone can make is none.
Loading loading(std::span<const float> positions, std::span<const double> origin,
                std::span<const double> texts, std::span<const std::uint32_t> triangles);

} // namespace paradize::reference
