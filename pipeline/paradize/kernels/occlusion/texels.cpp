#include "occlusion/texels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace paradize::occlusion {
namespace {

constexpr double within = 1e-6; // a centre with all weights above it lies inside, not at the edge

struct Corners {
    std::array<double, 3> x, y;
    double area() const { return (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]); }
    std::array<double, 3> weights(double px, double py) const {
        const double whole = area();
        const double b = ((px - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (py - y[0])) / whole;
        const double c = ((x[1] - x[0]) * (py - y[0]) - (px - x[0]) * (y[1] - y[0])) / whole;
        return {1 - b - c, b, c};
    }
};

std::size_t wrapped(double i, std::size_t size) {
    const double n = static_cast<double>(size);
    const auto at = static_cast<std::size_t>(i - n * std::floor(i / n));
    return at < size ? at : 0;
}

// The nearest point of a triangle, or of what is left of it where it has no area.
std::array<double, 3> nearest(const Corners &c, double px, double py) {
    if (c.area() != 0) {
        const auto w = c.weights(px, py);
        if (w[0] >= 0 && w[1] >= 0 && w[2] >= 0) {
            return w;
        }
    }
    std::array<double, 3> best{1, 0, 0};
    double least = std::sqrt((px - c.x[0]) * (px - c.x[0]) + (py - c.y[0]) * (py - c.y[0]));
    for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t l = (k + 1) % 3;
        const double dx = c.x[l] - c.x[k], dy = c.y[l] - c.y[k], squared = dx * dx + dy * dy;
        const double along = squared > 0 ? ((px - c.x[k]) * dx + (py - c.y[k]) * dy) / squared : 0;
        const double s = std::clamp(along, 0.0, 1.0);
        const double off = std::sqrt((c.x[k] + s * dx - px) * (c.x[k] + s * dx - px) +
                                     (c.y[k] + s * dy - py) * (c.y[k] + s * dy - py));
        if (off < least) {
            least = off;
            best = {0, 0, 0};
            best[k] = 1 - s;
            best[l] = s;
        }
    }
    return best;
}

} // namespace

Places places_of(std::span<const float> uvs, std::span<const std::uint32_t> triangles,
                 std::span<const std::int32_t> touched, std::size_t rows, std::size_t columns,
                 std::size_t most) {
    Places out;
    std::vector<std::uint8_t> seen(rows * columns, 0); // 1: at an edge, 2: inside one, 3: inside several
    const auto corners_of = [&](std::size_t t) {
        Corners c;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t v = triangles[3 * t + k];
            c.x[k] = static_cast<double>(uvs[2 * v]) * static_cast<double>(columns);
            c.y[k] = static_cast<double>(uvs[2 * v + 1]) * static_cast<double>(rows);
        }
        return c;
    };
    const auto add = [&](std::size_t texel, std::size_t triangle, const std::array<double, 3> &weights) {
        if (out.texel.size() >= most) {
            throw std::length_error("the UVs overlap too often");
        }
        out.texel.push_back(static_cast<std::uint32_t>(texel));
        out.triangle.push_back(static_cast<std::uint32_t>(triangle));
        out.weights.insert(out.weights.end(), weights.begin(), weights.end());
    };
    for (std::size_t t = 0; t < triangles.size() / 3; ++t) {
        const Corners c = corners_of(t);
        if (!(c.area() != 0)) {
            continue;
        }
        const auto [left, right] = std::minmax({c.x[0], c.x[1], c.x[2]});
        const auto [top, bottom] = std::minmax({c.y[0], c.y[1], c.y[2]});
        for (double j = std::ceil(top - 0.5); j + 0.5 <= bottom; j += 1) {
            for (double i = std::ceil(left - 0.5); i + 0.5 <= right; i += 1) {
                const auto w = c.weights(i + 0.5, j + 0.5);
                const double smallest = std::min({w[0], w[1], w[2]});
                if (!(smallest >= 0)) {
                    continue;
                }
                const std::size_t texel = wrapped(j, rows) * columns + wrapped(i, columns);
                add(texel, t, w);
                std::uint8_t &state = seen[texel];
                if (smallest > within) {
                    out.shared += state == 2 ? 1 : 0;
                    state = state >= 2 ? 3 : 2;
                } else {
                    state = std::max<std::uint8_t>(state, 1);
                }
            }
        }
    }
    for (std::size_t texel = 0; texel < touched.size(); ++texel) {
        if (seen[texel] != 0 || touched[texel] < 0) {
            continue;
        }
        const auto t = static_cast<std::size_t>(touched[texel]);
        const Corners c = corners_of(t);
        const auto beside = [](double p, double middle, double size) { // in the triangle's own tile
            return p + size * std::floor((middle - p) / size + 0.5);
        };
        const double n = static_cast<double>(columns), m = static_cast<double>(rows);
        const double x = static_cast<double>(texel % columns) + 0.5;
        const double y = static_cast<double>(texel / columns) + 0.5;
        add(texel, t,
            nearest(c, beside(x, (c.x[0] + c.x[1] + c.x[2]) / 3, n),
                    beside(y, (c.y[0] + c.y[1] + c.y[2]) / 3, m)));
    }
    return out;
}

} // namespace paradize::occlusion
