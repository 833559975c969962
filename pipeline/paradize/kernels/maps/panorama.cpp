#include "maps/panorama.hpp"

#include "math/functions.hpp"
#include "parallel.hpp"

#include <algorithm>
#include <cmath>

namespace paradize::maps {
namespace {

using Light = std::array<double, 3>;

// The light at a place of the panorama, in texels from the outer edges of the first. Beyond the top and the
// bottom the other side of the pole lies.
Light light_at(const Panorama &panorama, double column, double row) {
    const double left = std::floor(column - 0.5), above = std::floor(row - 0.5);
    const double along = column - 0.5 - left, down = row - 0.5 - above;
    const auto columns = static_cast<std::ptrdiff_t>(panorama.columns),
               rows = static_cast<std::ptrdiff_t>(panorama.rows);
    Light sum{};
    for (std::ptrdiff_t j = 0; j < 2; ++j) {
        const std::ptrdiff_t y = static_cast<std::ptrdiff_t>(above) + j;
        const bool beyond = y < 0 || y >= rows;
        const float *texels =
            &panorama.light[static_cast<std::size_t>(std::clamp(y, {}, rows - 1) * columns) * 3];
        for (std::ptrdiff_t i = 0; i < 2; ++i) {
            std::ptrdiff_t x = static_cast<std::ptrdiff_t>(left) + i + (beyond ? columns / 2 : 0);
            x += x < 0 ? columns : x >= columns ? -columns : 0;
            const double weight = (i == 0 ? 1.0 - along : along) * (j == 0 ? 1.0 - down : down);
            for (std::size_t k = 0; k < 3; ++k) {
                sum[k] += weight * texels[static_cast<std::size_t>(x) * 3 + k];
            }
        }
    }
    return sum;
}

} // namespace

void cut_face(const Panorama &panorama, const CubeFace &face, std::size_t spots, std::span<float> out,
              int threads) {
    const double step = 2.0 / static_cast<double>(face.size * spots);
    const auto place = [&](std::size_t texel, std::size_t spot) {
        return (static_cast<double>(texel * spots + spot) + 0.5) * step - 1.0;
    };
    const auto columns = static_cast<double>(panorama.columns), rows = static_cast<double>(panorama.rows);
    for_rows(face.size, threads, [&](std::size_t first, std::size_t end) {
        for (std::size_t y = first; y < end; ++y) {
            for (std::size_t x = 0; x < face.size; ++x) {
                Light sum{};
                double whole = 0.0;
                for (std::size_t j = 0; j < spots; ++j) {
                    for (std::size_t i = 0; i < spots; ++i) {
                        const double s = place(x, i), t = place(y, j);
                        const double length = std::sqrt(1.0 + s * s + t * t);
                        const double weight = 1.0 / (length * length * length);
                        Light to{};
                        for (std::size_t k = 0; k < 3; ++k) {
                            to[k] = face.middle[k] + s * face.right[k] + t * face.down[k];
                        }
                        const double east = mathx::atan2(to[0], -to[2]);
                        const double up = mathx::atan2(to[1], std::sqrt(to[0] * to[0] + to[2] * to[2]));
                        const Light light = light_at(panorama, (0.5 + east / (2.0 * mathx::pi)) * columns,
                                                     (0.5 - up / mathx::pi) * rows);
                        whole += weight;
                        for (std::size_t k = 0; k < 3; ++k) {
                            sum[k] += weight * light[k];
                        }
                    }
                }
                for (std::size_t k = 0; k < 3; ++k) {
                    out[(y * face.size + x) * 3 + k] = static_cast<float>(sum[k] / whole);
                }
            }
        }
    });
}

} // namespace paradize::maps
