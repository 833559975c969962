// One polygon of any size -> triangles.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace paradize::obj {

enum class Cut {
    sound,     // every triangle lies inside the polygon and has area
    collinear, // the polygon has no area: a fan
    crossing,  // the outline crosses itself: some triangles overlap
    unchecked, // the work limit was met: cut without the check for other corners inside
};

// Cuts polygons, one after the other; keeps its working memory between them.
class Triangulator {
  public:
    // Cuts a polygon with n >= 3 corners into exactly n - 2 triangles and appends their corner numbers (0 ..
    // n-1). `corners`: (n, 3) float64, any unit, finite. A fan from corner 0 where that is right, else ear
    // clipping in the plane that the polygon's normal (Newell) is steepest to (Meisters, "Polygons have
    // ears", 1975). `work`: corner-in-ear tests that may still be made; each one made is taken off.
    Cut cut(std::span<const std::array<double, 3>> corners, std::uint64_t &work,
            std::vector<std::uint32_t> &out);

    struct Point {
        double x, y;
        bool operator==(const Point &) const = default;
    };

  private:
    std::vector<Point> points_;
    std::vector<std::uint32_t> next_, previous_;
};

} // namespace paradize::obj
