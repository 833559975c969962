#include "terrain/tiles.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "parallel.hpp"
#include "terrain/line.hpp"

namespace paradize::terrain {
namespace {

constexpr int side = 128; // pixels of a tile, about: its heights stay in a core's cache

std::vector<std::uint16_t> cuts(std::uint16_t last) {
    const int count = (last + side - 1) / side;
    std::vector<std::uint16_t> found;
    for (int k = 0; k <= count; ++k) {
        found.push_back(static_cast<std::uint16_t>(static_cast<std::int64_t>(last) * k / count));
    }
    return found;
}

} // namespace

Tiles::Tiles(View view, Pixel last, double tolerance)
    : view_(view), tolerance_(tolerance), columns_(cuts(last.x)), rows_(cuts(last.y)) {
    for (const std::uint16_t y : rows_) {
        for (std::size_t k = 0; k < across(); ++k) {
            borders_.push_back({{columns_[k], y}, {columns_[k + 1], y}, {}, {}, {}});
        }
    }
    for (const std::uint16_t x : columns_) {
        for (std::size_t k = 0; k < down(); ++k) {
            borders_.push_back({{x, rows_[k]}, {x, rows_[k + 1]}, {}, {}, {}});
        }
    }
}

// The fewest pixels, greedily, whose polyline keeps the tolerance along the border.
void Tiles::split(Border &border) const {
    const auto add = [&](std::uint32_t before, std::uint32_t after, Pixel spot) {
        border.inner.push_back(spot);
        border.before.push_back(before);
        border.after.push_back(after);
        return static_cast<std::uint32_t>(border.inner.size() - 1);
    };
    Line(view_, border.from, border.to).split(tolerance_, Border::start, Border::end, add);
}

Tiles::Tile Tiles::mesh(std::size_t row, std::size_t column) const {
    const Pixel first{columns_[column], rows_[row]};
    const Pixel last{static_cast<std::uint16_t>(columns_[column + 1] - first.x),
                     static_cast<std::uint16_t>(rows_[row + 1] - first.y)};
    const std::size_t width = last.x + 1U;
    std::vector<float> heights;
    heights.reserve(width * (last.y + 1U));
    for (std::size_t y = first.y; y <= rows_[row + 1]; ++y) {
        const float *from = view_.at + y * view_.stride + first.x;
        heights.insert(heights.end(), from, from + width);
    }
    Mesher mesher({heights.data(), width, heights.data() + heights.size()}, tolerance_);
    mesher.start({{0, 0}, {last.x, 0}, last, {0, last.y}});
    const std::array<std::size_t, 4> borders = around(row, column);
    for (std::uint32_t side = 0; side < 4; ++side) {
        const Border &border = borders_[borders[side]];
        const bool against = side >= 2; // the lower border runs against the turn, and so does the left one
        const std::uint32_t from = against ? (side + 1) % 4 : side, to = against ? side : (side + 1) % 4;
        const auto base = static_cast<std::uint32_t>(mesher.net().vertices.size());
        for (std::size_t k = 0; k < border.inner.size(); ++k) {
            const std::uint32_t before = against ? border.after[k] : border.before[k];
            const Pixel spot = border.inner[k];
            mesher.insert_on_rim(
                before == Border::start ? from
                : before == Border::end ? to
                                        : base + before,
                {static_cast<std::uint16_t>(spot.x - first.x), static_cast<std::uint16_t>(spot.y - first.y)});
        }
    }
    Tile tile;
    tile.fixed = static_cast<std::uint32_t>(mesher.net().vertices.size());
    mesher.refine_all();
    tile.net = mesher.release();
    for (Pixel &spot : tile.net.vertices) {
        spot = {static_cast<std::uint16_t>(spot.x + first.x), static_cast<std::uint16_t>(spot.y + first.y)};
    }
    return tile;
}

// The net's index of each of a tile's first vertices.
std::vector<std::uint32_t> Tiles::global_of(std::size_t row, std::size_t column) const {
    const auto crossing = [&](std::size_t r, std::size_t c) {
        return static_cast<std::uint32_t>(r * columns_.size() + c);
    };
    std::vector<std::uint32_t> found{crossing(row, column), crossing(row, column + 1),
                                     crossing(row + 1, column + 1), crossing(row + 1, column)};
    for (const std::size_t border : around(row, column)) {
        for (std::uint32_t k = 0; k < borders_[border].inner.size(); ++k) {
            found.push_back(borders_[border].first + k);
        }
    }
    return found;
}

HalfEdgeMesh Tiles::sew(int threads, std::vector<std::uint32_t> &seams) {
    for_each_job(borders_.size(), threads, [&](std::size_t k) { split(borders_[k]); });
    tracked_ = static_cast<std::uint32_t>(columns_.size() * rows_.size());
    for (Border &border : borders_) {
        border.first = tracked_;
        tracked_ += static_cast<std::uint32_t>(border.inner.size());
    }
    std::vector<Tile> tiles(across() * down());
    for_each_job(tiles.size(), threads, [&](std::size_t k) { tiles[k] = mesh(k / across(), k % across()); });

    HalfEdgeMesh whole;
    std::size_t vertices = tracked_, corners = 0;
    for (const Tile &tile : tiles) {
        vertices += tile.net.vertices.size() - tile.fixed;
        corners += tile.net.corners.size();
    }
    whole.vertices.reserve(vertices);
    whole.corners.reserve(corners);
    whole.twins.reserve(corners);
    for (const std::uint16_t y : rows_) {
        for (const std::uint16_t x : columns_) {
            whole.vertices.push_back({x, y});
        }
    }
    for (const Border &border : borders_) {
        whole.vertices.insert(whole.vertices.end(), border.inner.begin(), border.inner.end());
    }
    struct Side { // of a tile, on a border
        std::uint32_t low, high, edge;
        bool operator<(const Side &other) const {
            return low != other.low ? low < other.low : high < other.high;
        }
    };
    std::vector<Side> sides;
    for (std::size_t k = 0; k < tiles.size(); ++k) {
        Tile tile = std::move(tiles[k]);
        const std::vector<std::uint32_t> fixed = global_of(k / across(), k % across());
        const auto shift = static_cast<std::uint32_t>(whole.vertices.size()) - tile.fixed;
        const auto base = static_cast<std::uint32_t>(whole.corners.size());
        whole.vertices.insert(whole.vertices.end(), tile.net.vertices.begin() + tile.fixed,
                              tile.net.vertices.end());
        for (const std::uint32_t corner : tile.net.corners) {
            whole.corners.push_back(corner < tile.fixed ? fixed[corner] : corner + shift);
        }
        for (std::uint32_t edge = 0; edge < tile.net.twins.size(); ++edge) {
            const std::uint32_t twin = tile.net.twins[edge];
            whole.twins.push_back(twin == none ? none : twin + base);
            if (twin == none) {
                const std::uint32_t a = whole.corners[base + edge];
                const std::uint32_t b = whole.corners[base + (edge % 3 == 2 ? edge - 2 : edge + 1)];
                sides.push_back({std::min(a, b), std::max(a, b), base + edge});
            }
        }
    }
    std::stable_sort(sides.begin(), sides.end());
    for (std::size_t k = 0; k + 1 < sides.size(); ++k) {
        if (sides[k].low == sides[k + 1].low && sides[k].high == sides[k + 1].high) {
            whole.twins[sides[k].edge] = sides[k + 1].edge;
            whole.twins[sides[k + 1].edge] = sides[k].edge;
            seams.push_back(sides[k].edge);
        }
    }
    return whole;
}

std::vector<std::uint32_t> Tiles::removal_order() const {
    const auto crossings = static_cast<std::uint32_t>(columns_.size() * rows_.size());
    std::vector<std::uint32_t> order;
    for (std::uint32_t k = crossings; k < tracked_; ++k) {
        order.push_back(k);
    }
    const auto level = [&](std::uint32_t k) {
        const auto r = static_cast<std::uint32_t>(k / columns_.size()),
                   c = static_cast<std::uint32_t>(k % columns_.size());
        return std::countr_zero(r | c | 1U << 16);
    };
    std::vector<std::uint32_t> grid(crossings);
    for (std::uint32_t k = 0; k < crossings; ++k) {
        grid[k] = k;
    }
    std::stable_sort(grid.begin(), grid.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return level(a) < level(b); });
    order.insert(order.end(), grid.begin(), grid.end());
    return order;
}

} // namespace paradize::terrain
