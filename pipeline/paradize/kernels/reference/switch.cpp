#include "reference/switch.hpp"

#include <algorithm>

#include "math/functions.hpp"
#include "parallel.hpp"
#include "reference/flip.hpp"

namespace paradize::reference {
namespace {

// The smallest linear value of each code of sRGB but the first, by rounding to the nearest.
std::array<double, 255> lowest_of_codes() {
    std::array<double, 255> out{};
    for (std::size_t k = 0; k < out.size(); ++k) {
        out[k] = mathx::srgb_to_linear((static_cast<double>(k) + 0.5) / 255);
    }
    return out;
}

// Over a background, as a screen shows it: (rows, columns, 3).
std::vector<std::uint8_t> encoded(const LitPicture &picture, std::uint8_t background) {
    static const std::array<double, 255> lowest = lowest_of_codes();
    const double behind = mathx::srgb_to_linear(background / 255.0);
    std::vector<std::uint8_t> out(picture.rows * picture.columns * 3);
    for (std::size_t k = 0; k < picture.rows * picture.columns; ++k) {
        const float *pixel = &picture.pixels[k * 4];
        for (std::size_t c = 0; c < 3; ++c) {
            const double value = static_cast<double>(pixel[c]) + (1 - static_cast<double>(pixel[3])) * behind;
            out[k * 3 + c] =
                static_cast<std::uint8_t>(std::ranges::upper_bound(lowest, value) - lowest.begin());
        }
    }
    return out;
}

} // namespace

std::vector<double> switch_flips(const SeenMesh &before, const SeenMesh &after,
                                 std::span<const double> directions, double pixel, const SwitchPictures &how,
                                 int threads) {
    std::vector<double> out(directions.size() / 3);
    for_each_job(out.size(), threads, [&](std::size_t k) {
        const Point toward{directions[k * 3], directions[k * 3 + 1], directions[k * 3 + 2]};
        const LitPair pair = lit_pictures(before, after, toward, pixel, how.samples, flip_reach, how.light);
        const auto first = encoded(pair.first, how.background), second = encoded(pair.second, how.background);
        const std::size_t rows = pair.first.rows, columns = pair.first.columns;
        if (first == second) {
            return;
        }
        const std::vector<float> errors = flip(first, second, rows, columns);
        const auto inside = [](double at, std::size_t count) {
            return static_cast<std::size_t>(std::clamp(at, 0.0, static_cast<double>(count)));
        };
        double sum = 0;
        for (std::size_t y = inside(pair.low[1], rows); y < inside(pair.high[1], rows); ++y) {
            for (std::size_t x = inside(pair.low[0], columns); x < inside(pair.high[0], columns); ++x) {
                sum += errors[y * columns + x];
            }
        }
        out[k] = sum / ((pair.high[0] - pair.low[0]) * (pair.high[1] - pair.low[1]));
    });
    return out;
}

} // namespace paradize::reference
