#include "reference/terrain.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "reference/terrain_field.hpp"

namespace paradize::reference {
namespace {

struct Line { // a * x + b * y + c: 0 on a side of the patch, positive inside
    double a, b, c;
    double at(double x, double y) const { return a * x + b * y + c; }
};

std::array<Line, 3> sides(const std::array<GridPoint, 3> &corners) {
    std::array<Line, 3> found{};
    for (std::size_t k = 0; k < 3; ++k) {
        const GridPoint &p = corners[k], &q = corners[(k + 1) % 3], &r = corners[(k + 2) % 3];
        const auto a = static_cast<double>(p.row - q.row), b = static_cast<double>(q.column - p.column);
        Line line{a, b, -a * static_cast<double>(p.column) - b * static_cast<double>(p.row)};
        if (line.at(static_cast<double>(r.column), static_cast<double>(r.row)) < 0.0) {
            line = {-line.a, -line.b, -line.c};
        }
        found[k] = line;
    }
    return found;
}

// The side of a face from corner k on, which lies on a side of the patch: its distance at the pixels between.
void along(const Face &face, int k, double slack, const HeightField &height_field, const Window &window,
           std::vector<double> &error) {
    const int n = (k + 1) % 3;
    const double dx = face.x[n] - face.x[k], dz = face.z[n] - face.z[k];
    const bool wide = std::fabs(dx) >= std::fabs(dz);
    const double from = wide ? face.x[k] : face.z[k], run = wide ? dx : dz;
    if (std::fabs(run) < 0.5) {
        return;
    }
    const double low = std::min(from, from + run) - slack, high = std::max(from, from + run) + slack;
    for (double step = std::ceil(low); step <= high; step += 1.0) {
        const double share = std::clamp((step - from) / run, 0.0, 1.0);
        const double x = wide ? step : std::round(face.x[k] + share * dx),
                     z = wide ? std::round(face.z[k] + share * dz) : step;
        const bool seen = x >= static_cast<double>(window.left) && x < static_cast<double>(window.right) &&
                          z >= static_cast<double>(window.top) && z < static_cast<double>(window.bottom);
        if (!seen) {
            continue;
        }
        const auto row = static_cast<std::size_t>(z), column = static_cast<std::size_t>(x);
        const double height = face.y[k] + share * (face.y[n] - face.y[k]);
        double &found = error[window.index(row, column)];
        found = std::max(
            found, std::fabs(height -
                             static_cast<double>(height_field.heights[row * height_field.columns + column])));
    }
}

} // namespace

PatchError patch_error(std::span<const float> positions, std::span<const std::uint32_t> triangles,
                       const HeightField &height_field, const std::array<GridPoint, 3> &corners) {
    const Field field(positions, triangles, height_field);
    const std::array<Line, 3> lines = sides(corners);
    PatchError found;
    // The window holds the patch and one pixel more, where strays show.
    const auto last_row = static_cast<std::int64_t>(height_field.rows) - 1,
               last_column = static_cast<std::int64_t>(height_field.columns) - 1;
    GridPoint low = corners[0], high = low;
    for (const GridPoint &corner : corners) {
        low = {std::min(low.row, corner.row), std::min(low.column, corner.column)};
        high = {std::max(high.row, corner.row), std::max(high.column, corner.column)};
    }
    const auto clamped = [](std::int64_t at, std::int64_t end) {
        return static_cast<std::size_t>(std::clamp<std::int64_t>(at, 0, end));
    };
    const Window window{clamped(low.row - 1, last_row + 1), clamped(high.row + 2, last_row + 1),
                        clamped(low.column - 1, last_column + 1), clamped(high.column + 2, last_column + 1)};
    std::vector<double> error(window.count(), -1.0);
    for (std::size_t triangle = 0; triangle < triangles.size() / 3; ++triangle) {
        const Face face = field.face(triangle);
        if (!(face.area > 0.0)) {
            ++found.inside.flipped;
            continue;
        }
        field.meet(face, window, error);
        for (int k = 0; k < 3; ++k) {
            const int n = (k + 1) % 3;
            for (const Line &line : lines) {
                const double near = field.slack() * std::max(std::fabs(line.a), std::fabs(line.b));
                if (std::fabs(line.at(face.x[k], face.z[k])) <= near &&
                    std::fabs(line.at(face.x[n], face.z[n])) <= near) {
                    along(face, k, field.slack(), height_field, window, error);
                }
            }
        }
    }
    TerrainError &inside = found.inside;
    for (std::size_t row = window.top; row < window.bottom; ++row) {
        double squares = 0.0;
        for (std::size_t column = window.left; column < window.right; ++column) {
            const double off = error[window.index(row, column)];
            const auto x = static_cast<double>(column), z = static_cast<double>(row);
            if (lines[0].at(x, z) < 0.0 || lines[1].at(x, z) < 0.0 || lines[2].at(x, z) < 0.0) {
                found.strays += off >= 0.0 ? 1 : 0;
            } else if (off < 0.0) {
                ++inside.holes;
            } else {
                ++inside.covered;
                squares += off * off;
                if (off > inside.max_m) {
                    inside.max_m = off;
                    inside.worst = row * height_field.columns + column;
                }
            }
        }
        inside.squares += squares;
    }
    return found;
}

} // namespace paradize::reference
