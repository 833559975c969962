// The worst pixel of a triangle whose corners are pixels. Spans of rows are exact: no pixel on a border is
// missed and none outside is visited.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

namespace paradize::terrain {

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

// A pixel; coordinates at most 16384.
struct Pixel {
    std::uint16_t x, y;
    bool operator==(const Pixel &other) const = default;
};

constexpr std::uint32_t packed(Pixel spot) {
    return static_cast<std::uint32_t>(spot.y) << 16 | static_cast<std::uint32_t>(spot.x);
}
constexpr Pixel unpacked(std::uint32_t pixel) {
    return {static_cast<std::uint16_t>(pixel & 0xffffU), static_cast<std::uint16_t>(pixel >> 16)};
}

// A window of the height field: at[y * stride + x]; nothing is read from `end` on.
struct View {
    const float *at;
    std::size_t stride;
    const float *end;
    float height(Pixel spot) const { return at[spot.y * stride + spot.x]; }
};

struct Worst {
    double error;        // of `pixel`, above the tolerance; the tolerance where there is none
    std::uint32_t pixel; // packed; `none` where all pixels keep the tolerance
};

// Positive when a, b, c turn the way of every triangle here (x to the right, y down: clockwise).
inline std::int64_t turn(Pixel a, Pixel b, Pixel c) {
    return (static_cast<std::int64_t>(b.x) - a.x) * (static_cast<std::int64_t>(c.y) - a.y) -
           (static_cast<std::int64_t>(b.y) - a.y) * (static_cast<std::int64_t>(c.x) - a.x);
}

// A pixel of the closed triangle a, b, c (positive turn), its corners excepted, that lies by more than
// `tolerance` from the plane through the corners' heights, where there is any: the farthest, of equals the
// first in reading order; in a large triangle the farthest of some rows, where those hold one. In float64,
// the same bits on every CPU. skipped: bits of the sides (1: ab, 2: bc, 4: ca) whose pixels do not count.
Worst scan_triangle(View view, Pixel a, Pixel b, Pixel c, double tolerance, unsigned skipped = 0);

} // namespace paradize::terrain
