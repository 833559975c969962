// Normal kernels without Python: what the sanitizers see runs here.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <vector>

#include "normals/codes.hpp"
#include "normals/field.hpp"
#include "normals/light.hpp"
#include "normals/material.hpp"

using namespace paradize;
using namespace paradize::normals;

namespace {

constexpr double derivatives[5] = {0.5, -0.1, 0.05, -0.02, 0.01};
constexpr double smoothing[3] = {0.5, 0.2, 0.05};
const Width widths[] = {Width::baseline, Width::avx2, Width::avx512};

std::vector<float> ramp(std::size_t count) {
    std::vector<float> out(count);
    for (std::size_t i = 0; i < count; ++i) {
        out[i] = static_cast<float>(i * 37 % 101) / 101.0F;
    }
    return out;
}

Settings taps(int reach, int across, double scale, bool wrap) {
    return {derivatives, reach, smoothing, across, scale, -scale, wrap, wrap, false};
}

std::vector<std::uint8_t> run(const std::vector<float> &heights, std::size_t rows, std::size_t columns,
                              const std::vector<std::int32_t> &islands, const Settings &settings,
                              Encoding encoding, int threads, Width width) {
    std::vector<std::uint8_t> out(rows * columns * texel_bytes(encoding));
    normals_from_heights(heights, rows, columns, islands, settings, 0, rows, encoding, out, threads, width);
    return out;
}

} // namespace

TEST_CASE("normals of any size, reach, border, thread count and instruction set are the same bits") {
    for (const auto &[reach, across] : {std::pair{1, 0}, {2, 0}, {3, 1}, {4, 1}, {5, 0}, {2, 2}}) {
        for (const std::size_t rows : {1, 2, 5, 9}) {
            for (const std::size_t columns : {1, 3, 16, 37}) {
                const auto heights = ramp(rows * columns);
                std::vector<std::int32_t> islands(rows * columns);
                for (std::size_t i = 0; i < islands.size(); ++i) {
                    islands[i] = static_cast<std::int32_t>(i / 3 % 3) - 1;
                }
                for (const double scale : {3.0, 1e22, 1e40}) {
                    for (const bool wrap : {false, true}) {
                        for (const auto encoding : {Encoding::float3, Encoding::rgb8, Encoding::snorm8}) {
                            const auto settings = taps(reach, across, scale, wrap);
                            for (const auto &ids : {islands, std::vector<std::int32_t>{}}) {
                                const auto one =
                                    run(heights, rows, columns, ids, settings, encoding, 1, Width::widest);
                                CHECK(one ==
                                      run(heights, rows, columns, ids, settings, encoding, 4, Width::widest));
                                for (const Width width : widths) {
                                    if (kernels_of(width) != nullptr) {
                                        CHECK(one ==
                                              run(heights, rows, columns, ids, settings, encoding, 2, width));
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

TEST_CASE("codes are the nearest, and the fine code comes back from two bytes") {
    for (int step = -400000; step <= 400000; ++step) {
        const float v = static_cast<float>(step) / 400000.0F;
        const double wanted = std::floor(127.5 * static_cast<double>(v) + 128.0);
        CHECK(static_cast<double>(unorm_code(v)) == std::min(255.0, wanted));
        const double signed_code = std::round(127.0 * static_cast<double>(v));
        CHECK(static_cast<double>(snorm_code(v)) == signed_code);
        const std::int32_t fine = fine_code(v);
        CHECK(std::abs(fine - 127.0 * 256.0 * static_cast<double>(v)) <= 0.5001);
        CHECK(fine_code(unorm_code(v), static_cast<std::uint8_t>(fine & 255)) == fine);
    }
}

TEST_CASE("a height or a slope that is not finite is refused wherever it stands") {
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        for (std::size_t at = 0; at < 90; at += 7) {
            std::vector<float> heights(90, 1.0F);
            heights[at] = bad;
            const auto settings = taps(2, 0, 1.0, false);
            for (const Width width : {Width::widest, Width::baseline}) {
                CHECK_THROWS_AS(run(heights, 5, 18, {}, settings, Encoding::rgb8, 2, width), NotFinite);
                std::vector<std::uint8_t> out(90 * 3);
                CHECK_THROWS_AS(normals_from_slopes(heights, heights, 5, 18, 1.0, 1.0, false, Encoding::rgb8,
                                                    out, 2, width),
                                NotFinite);
            }
        }
    }
}

TEST_CASE("the maps of a picture are the same bits however they are made, and du/dv sums to zero") {
    for (const std::size_t channels : {3, 4}) {
        for (const std::size_t columns : {1, 31, 64, 131}) {
            const std::size_t rows = 7;
            std::vector<std::uint8_t> bytes(rows * columns * channels);
            for (std::size_t i = 0; i < bytes.size(); ++i) {
                bytes[i] = static_cast<std::uint8_t>(i * i * 13 % 251 + i % 5);
            }
            const ColorView color{bytes.data(), nullptr, nullptr, rows, columns, channels};
            for (const double scale : {0.0, 4.0, 900.0, 1e25}) {
                const MaterialSettings settings{taps(2, 0, scale, true),
                                                {},
                                                {0.0, 1.0, 2.0, 1.0, 0.0, false},
                                                0.0F,
                                                1.0F,
                                                0.3F,
                                                0.3F,
                                                true};
                std::vector<std::uint16_t> height(rows * columns);
                std::vector<std::uint8_t> normal(rows * columns * 3);
                std::vector<std::uint8_t> gloss(rows * columns * 2);
                std::vector<std::int8_t> dudv(rows * columns * 2);
                const MaterialOut out{height, normal, gloss, dudv};
                material_maps(color, settings, out, 1);
                const auto first = std::tuple{height, normal, gloss, dudv};
                for (const Width width : widths) {
                    if (kernels_of(width) != nullptr) {
                        material_maps(color, settings, out, 3, width);
                        CHECK((first == std::tuple{height, normal, gloss, dudv}));
                    }
                }
                std::int64_t sums[2] = {0, 0};
                for (std::size_t i = 0; i < dudv.size(); ++i) {
                    sums[i % 2] += dudv[i];
                }
                CHECK(sums[0] == 0);
                CHECK(sums[1] == 0);
            }
        }
    }
}
