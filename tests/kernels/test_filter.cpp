// Derivative filters' kernels without Python: what the sanitizers see runs here.
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "filter/choose.hpp"
#include "filter/destep.hpp"
#include "filter/fft.hpp"

using namespace paradize;

namespace {

std::vector<float> bumps(std::size_t count) {
    std::vector<float> out(count);
    for (std::size_t i = 0; i < count; ++i) {
        out[i] = static_cast<float>(i * 37 % 101) / 101.0F;
    }
    return out;
}

} // namespace

TEST_CASE("a transform is the plain sum") {
    for (std::size_t n = 1; n <= 128; n *= 2) {
        const filter::Fft fft(n);
        std::vector<double> data(n * filter::element);
        for (std::size_t i = 0; i < data.size(); ++i) {
            data[i] = static_cast<double>(i * 31 % 17) - 8.0;
        }
        const std::vector<double> before = data;
        std::vector<double> scratch(data.size());
        fft.forward(data.data(), scratch.data());
        for (std::size_t k = 0; k < n; k += 7) {
            for (const std::size_t lane : {std::size_t{0}, filter::lanes - 1}) {
                double re = 0.0;
                double im = 0.0;
                for (std::size_t j = 0; j < n; ++j) {
                    const double angle = -2.0 * 3.14159265358979323846 * static_cast<double>(j * k % n) /
                                         static_cast<double>(n);
                    const double a = before[j * filter::element + lane];
                    const double b = before[j * filter::element + filter::lanes + lane];
                    re += a * std::cos(angle) - b * std::sin(angle);
                    im += a * std::sin(angle) + b * std::cos(angle);
                }
                CHECK(std::abs(data[k * filter::element + lane] - re) < 1e-10);
                CHECK(std::abs(data[k * filter::element + filter::lanes + lane] - im) < 1e-10);
            }
        }
    }
}

TEST_CASE("errors are predicted for maps of any size, islands or none") {
    std::vector<double> derivative(2 * filter::reach, 0.0);
    std::vector<double> smooth(2 * (filter::reach + 1), 0.0);
    derivative[0] = 0.5;
    derivative[filter::reach] = 2.0 / 3.0;
    derivative[filter::reach + 1] = -1.0 / 12.0;
    smooth[0] = smooth[filter::reach + 1] = 1.0;
    for (const std::size_t rows : {1, 2, 5, 31, 140}) {
        for (const std::size_t columns : {1, 4, 16, 129}) {
            auto heights = bumps(rows * columns);
            std::vector<std::int32_t> islands(heights.size());
            for (std::size_t i = 0; i < islands.size(); ++i) {
                islands[i] = static_cast<std::int32_t>(i * 3 / islands.size()) - 1;
            }
            for (const int bits : {8, 16, 32}) {
                for (const bool aware : {false, true}) {
                    const std::span<const std::int32_t> ids =
                        aware ? std::span<const std::int32_t>(islands) : std::span<const std::int32_t>();
                    const auto found = filter::predict_errors(
                        {heights, rows, columns, ids, bits, true, false}, derivative, smooth);
                    REQUIRE(found.errors.size() == 2);
                    CHECK(std::isfinite(found.errors[0]));
                    CHECK(std::isfinite(found.errors[1]));
                }
            }
        }
    }
}

TEST_CASE("de-stepped heights of any size stay within half a step") {
    for (const std::size_t rows : {1, 2, 3, 9, 40}) {
        for (const std::size_t columns : {1, 2, 5, 33}) {
            auto heights = bumps(rows * columns);
            for (float &h : heights) {
                h = std::floor(h * 6.0F) / 8.0F;
            }
            for (const bool wrap : {false, true}) {
                std::vector<float> one(heights.size());
                std::vector<float> many(heights.size());
                filter::destep(heights, rows, columns, 0.125, wrap, !wrap, one, 1);
                filter::destep(heights, rows, columns, 0.125, wrap, !wrap, many, 3);
                CHECK(one == many);
                for (std::size_t i = 0; i < heights.size(); ++i) {
                    CHECK(std::abs(static_cast<double>(one[i]) - heights[i]) <= 0.0625);
                }
            }
        }
    }
}
