#include "terrain/patch.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "terrain/line.hpp"
#include "terrain/mesher.hpp"

namespace paradize::terrain {
namespace {

constexpr std::size_t kept_in_cache = std::size_t{1} << 20; // pixels

struct Side { // of the clipped polygon: from its first corner to the next side's
    Point from;
    double tolerance;
};

// Where the segment a -> b, along an axis or a diagonal, meets x = limit (or y): a whole number.
Point meet(Point a, Point b, std::int32_t Point::*axis, std::int32_t limit) {
    const auto other = axis == &Point::x ? &Point::y : &Point::x;
    const std::int32_t run = b.*axis - a.*axis, rise = b.*other - a.*other;
    const std::int32_t steps = limit - a.*axis;
    Point found = a;
    found.*axis = limit;
    found.*other += rise == 0 ? 0 : (rise > 0) == (run > 0) ? steps : -steps;
    return found;
}

// Sutherland and Hodgman, "Reentrant Polygon Clipping", 1974; exact.
void clip(std::vector<Side> &polygon, std::int32_t Point::*axis, std::int32_t limit, bool below, double rim) {
    std::vector<Side> kept;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
        const Side &side = polygon[k];
        const Point a = side.from, b = polygon[(k + 1) % polygon.size()].from;
        const bool has_a = below ? a.*axis <= limit : a.*axis >= limit;
        const bool has_b = below ? b.*axis <= limit : b.*axis >= limit;
        if (has_a) {
            kept.push_back(side);
        }
        if (has_a != has_b) {
            kept.push_back({meet(a, b, axis, limit), has_a ? rim : side.tolerance});
        }
    }
    polygon.clear();
    for (std::size_t k = 0; k < kept.size(); ++k) { // without sides of no length
        const Point a = kept[k].from, b = kept[(k + 1) % kept.size()].from;
        if (a.x != b.x || a.y != b.y) {
            polygon.push_back(kept[k]);
        }
    }
}

std::int64_t doubled_area(const std::vector<Side> &polygon) {
    std::int64_t area = 0;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
        const Point a = polygon[k].from, b = polygon[(k + 1) % polygon.size()].from;
        area += static_cast<std::int64_t>(a.x) * b.y - static_cast<std::int64_t>(a.y) * b.x;
    }
    return area;
}

} // namespace

bool is_patch(const std::array<Point, 3> &corners) {
    const std::int64_t ax = std::int64_t{corners[1].x} - corners[0].x,
                       ay = std::int64_t{corners[1].y} - corners[0].y,
                       bx = std::int64_t{corners[2].x} - corners[0].x,
                       by = std::int64_t{corners[2].y} - corners[0].y;
    const bool turned = (bx == ay && by == -ax) || (bx == -ay && by == ax);
    return turned && (ax != 0 || ay != 0) && (ax == 0 || ay == 0 || ax == ay || ax == -ay);
}

Triangulation patch(std::span<const float> heights, std::uint32_t width, std::uint32_t height,
                    const std::array<Point, 3> &corners, const PatchBounds &bounds, std::size_t most) {
    std::vector<Side> polygon{
        {corners[0], bounds.leg}, {corners[1], bounds.hypotenuse}, {corners[2], bounds.leg}};
    if (doubled_area(polygon) < 0) {
        std::swap(polygon[1].from, polygon[2].from);
    }
    const auto right = static_cast<std::int32_t>(width - 1), bottom = static_cast<std::int32_t>(height - 1);
    clip(polygon, &Point::x, 0, false, bounds.inside);
    clip(polygon, &Point::y, 0, false, bounds.inside);
    clip(polygon, &Point::x, right, true, bounds.inside);
    clip(polygon, &Point::y, bottom, true, bounds.inside);
    if (polygon.size() < 3 || doubled_area(polygon) <= 0) {
        return {};
    }

    Point first = polygon[0].from, last = first;
    for (const Side &side : polygon) {
        first = {std::min(first.x, side.from.x), std::min(first.y, side.from.y)};
        last = {std::max(last.x, side.from.x), std::max(last.y, side.from.y)};
    }
    View view{heights.data() + static_cast<std::size_t>(first.y) * width + first.x, width,
              heights.data() + heights.size()};
    const auto across = static_cast<std::size_t>(last.x - first.x + 1),
               down = static_cast<std::size_t>(last.y - first.y + 1);
    std::vector<float> near;
    if (across * down <= kept_in_cache) {
        for (std::size_t y = 0; y < down; ++y) {
            near.insert(near.end(), view.at + y * view.stride, view.at + y * view.stride + across);
        }
        view = {near.data(), across, near.data() + near.size()};
    }

    std::vector<Pixel> spots;
    for (const Side &side : polygon) {
        spots.push_back({static_cast<std::uint16_t>(side.from.x - first.x),
                         static_cast<std::uint16_t>(side.from.y - first.y)});
    }
    Mesher mesher(view, bounds.inside);
    mesher.start(spots);
    for (std::size_t k = 0; k < polygon.size(); ++k) {
        const auto from = static_cast<std::uint32_t>(k),
                   to = static_cast<std::uint32_t>((k + 1) % polygon.size());
        const auto add = [&](std::uint32_t before, std::uint32_t, Pixel spot) {
            return mesher.insert_on_rim(before, spot);
        };
        Line(view, spots[from], spots[to]).split(polygon[k].tolerance, from, to, add);
    }
    mesher.fix_rim();
    mesher.refine_all(most);
    HalfEdgeMesh net = mesher.release();
    for (Pixel &spot : net.vertices) {
        spot = {static_cast<std::uint16_t>(spot.x + first.x), static_cast<std::uint16_t>(spot.y + first.y)};
    }
    return listed(std::move(net), width);
}

} // namespace paradize::terrain
