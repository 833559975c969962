// The grid cut into tiles that are meshed apart and sewn together. What stands on a border between two tiles
// depends on the heights of that border alone, so both sides have it, whoever meshes them and when.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "terrain/mesher.hpp"

namespace paradize::terrain {

// One straight border from crossing to crossing: its vertices between them, and their first index in the net.
struct Border {
    Pixel from, to;
    std::vector<Pixel> inner; // each between two that came before it, or the ends: `before` is the nearer to
    std::vector<std::uint32_t> before, after; // `from`, `after` to `to`; indices of `inner`, or the ends'
    std::uint32_t first = 0;
    static constexpr std::uint32_t start = none, end = none - 1;
};

class Tiles {
  public:
    // heights: width x height, row by row; tolerance as in `refine`.
    Tiles(View view, Pixel last, double tolerance);

    // All tiles meshed on `threads` threads and sewn into one net, in which the `tracked` first vertices are
    // those of the borders. The borders are not Delaunay yet: `seams` are the half-edges on them.
    HalfEdgeMesh sew(int threads, std::vector<std::uint32_t> &seams);

    // The border vertices in the order in which to try to remove them: those between crossings, then the
    // crossings, the coarsest grid last, so that a hole never grows far beyond its neighbours.
    std::vector<std::uint32_t> removal_order() const;
    std::uint32_t tracked() const { return tracked_; }

  private:
    struct Tile {
        HalfEdgeMesh net;
        std::uint32_t fixed = 0; // its first vertices, which stand on its borders
    };

    View view_;
    double tolerance_;
    std::vector<std::uint16_t> columns_, rows_; // where the borders run
    std::vector<Border> borders_;               // along the rows first, then along the columns
    std::uint32_t tracked_ = 0;

    std::size_t across() const { return columns_.size() - 1; }
    std::size_t down() const { return rows_.size() - 1; }
    std::size_t along_row(std::size_t row, std::size_t tile) const { return row * across() + tile; }
    std::size_t along_column(std::size_t column, std::size_t tile) const {
        return rows_.size() * across() + column * down() + tile;
    }
    // Of a tile: the upper, right, lower and left border.
    std::array<std::size_t, 4> around(std::size_t row, std::size_t column) const {
        return {along_row(row, column), along_column(column + 1, row), along_row(row + 1, column),
                along_column(column, row)};
    }
    void split(Border &border) const;
    Tile mesh(std::size_t row, std::size_t column) const;
    std::vector<std::uint32_t> global_of(std::size_t row, std::size_t column) const;
};

} // namespace paradize::terrain
