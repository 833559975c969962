// A terrain mesh in the pixels of its height field, a face at a time: what the reference rasteriser and its
// error of single patches share.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "reference/terrain.hpp"

namespace paradize::reference {

constexpr double rim = 1e-9; // of a triangle: how far outside its border a pixel still counts as on it

struct Window { // rows [top, bottom) and columns [left, right) of pixels
    std::size_t top, bottom, left, right;
    std::size_t index(std::size_t row, std::size_t column) const {
        return (row - top) * (right - left) + column - left;
    }
    std::size_t count() const { return (bottom - top) * (right - left); }
};

struct Face {
    double x[3], y[3], z[3], area; // x, z in pixels
};

class Field {
  public:
    Field(std::span<const float> positions, std::span<const std::uint32_t> triangles,
          const HeightField &height_field)
        : positions_(positions), triangles_(triangles), height_field_(height_field),
          slack_(1e-6 * static_cast<double>(std::max(height_field.rows, height_field.columns))) {}

    Face face(std::size_t triangle) const {
        Face found{};
        for (std::size_t k = 0; k < 3; ++k) {
            const float *at = &positions_[3 * static_cast<std::size_t>(triangles_[3 * triangle + k])];
            found.x[k] = place(at[0], height_field_.size_x_m, height_field_.columns);
            found.y[k] = static_cast<double>(at[1]);
            found.z[k] = place(at[2], height_field_.size_z_m, height_field_.rows);
        }
        found.area = (found.x[2] - found.x[0]) * (found.z[1] - found.z[0]) -
                     (found.x[1] - found.x[0]) * (found.z[2] - found.z[0]);
        return found;
    }

    double slack() const { return slack_; }

    // Rows of pixels that a face may meet: [first, last), empty where there are none.
    std::pair<std::size_t, std::size_t> rows(const Face &face) const {
        return range(std::min({face.z[0], face.z[1], face.z[2]}), std::max({face.z[0], face.z[1], face.z[2]}),
                     height_field_.rows);
    }

    // Raises `error`, one value a pixel of the window, to the face's distance where it covers them.
    void meet(const Face &face, const Window &window, std::vector<double> &error) const {
        const auto [first, last] = rows(face);
        for (std::size_t row = std::max(first, window.top); row < std::min(last, window.bottom); ++row) {
            const double z = static_cast<double>(row);
            double left = static_cast<double>(height_field_.columns), right = -1.0;
            for (int k = 0; k < 3; ++k) { // where the row's line, widened by the slack, meets the borders
                const double za = face.z[k], zb = face.z[(k + 1) % 3], xa = face.x[k],
                             xb = face.x[(k + 1) % 3];
                const double from = std::max(std::min(za, zb), z - slack_),
                             to = std::min(std::max(za, zb), z + slack_);
                if (from > to) {
                    continue;
                }
                for (const double at : {from, to}) {
                    const double x = za == zb ? xa : xa + (xb - xa) * ((at - za) / (zb - za));
                    left = std::min({left, x, za == zb ? xb : x});
                    right = std::max({right, x, za == zb ? xb : x});
                }
            }
            const auto [from, to] = range(left, right, height_field_.columns);
            const float *heights = &height_field_.heights[row * height_field_.columns];
            for (std::size_t column = std::max(from, window.left); column < std::min(to, window.right);
                 ++column) {
                const double x = static_cast<double>(column);
                double plane = 0.0;
                bool inside = true;
                for (int k = 0; k < 3; ++k) { // the share of corner k: the area that the pixel spans there
                    const int a = (k + 1) % 3, b = (k + 2) % 3;
                    const double share =
                        ((face.x[b] - x) * (face.z[a] - z) - (face.x[a] - x) * (face.z[b] - z)) / face.area;
                    inside = inside && share >= -rim;
                    plane += share * face.y[k];
                }
                if (inside) {
                    double &found = error[window.index(row, column)];
                    found = std::max(found, std::fabs(plane - static_cast<double>(heights[column])));
                }
            }
        }
    }

  private:
    std::span<const float> positions_;
    std::span<const std::uint32_t> triangles_;
    const HeightField &height_field_;
    double slack_;

    // Into pixels: a whole number but for the rounding of float32; the rim is where its pixels are.
    double place(float at, double size_m, std::size_t pixels) const {
        const double last = static_cast<double>(pixels - 1);
        const double found = (static_cast<double>(at) / size_m + 0.5) * last;
        if (std::fabs(found) <= slack_) {
            return 0.0;
        }
        return std::fabs(found - last) <= slack_ ? last : found;
    }

    std::pair<std::size_t, std::size_t> range(double low, double high, std::size_t count) const {
        const double from = std::max(std::ceil(low - slack_), 0.0),
                     to = std::min(std::floor(high + slack_), static_cast<double>(count) - 1.0);
        if (!(from <= to)) {
            return {0, 0};
        }
        return {static_cast<std::size_t>(from), static_cast<std::size_t>(to) + 1};
    }
};

} // namespace paradize::reference
