// Normal kernels without Python: what the sanitizers see runs here.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <vector>

#include "normals/field.hpp"
#include "ramp.hpp"

using namespace paradize;
using namespace paradize::normals;

namespace {

constexpr double derivatives[5] = {0.5, -0.1, 0.05, -0.02, 0.01};
constexpr double smoothing[3] = {0.5, 0.2, 0.05};
const Width widths[] = {Width::baseline, Width::avx2, Width::avx512};

Settings taps(int reach, int across, double scale, bool wrap) {
    return {derivatives, reach, smoothing, across, scale, -scale, wrap, wrap, false};
}

std::vector<float> run(const std::vector<float> &heights, std::size_t rows, std::size_t columns,
                       const std::vector<std::int32_t> &islands, const Settings &settings, int threads,
                       Width width) {
    std::vector<float> out(rows * columns * 3);
    normals_from_heights(heights, rows, columns, islands, settings, 0, rows, out, threads, width);
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
                        const auto settings = taps(reach, across, scale, wrap);
                        for (const auto &ids : {islands, std::vector<std::int32_t>{}}) {
                            const auto one = run(heights, rows, columns, ids, settings, 1, Width::widest);
                            CHECK(one == run(heights, rows, columns, ids, settings, 4, Width::widest));
                            for (const Width width : widths) {
                                if (kernels_of(width) != nullptr) {
                                    CHECK(one == run(heights, rows, columns, ids, settings, 2, width));
                                }
                            }
                        }
                    }
                }
            }
        }
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
                CHECK_THROWS_AS(run(heights, 5, 18, {}, settings, 2, width), NotFinite);
                std::vector<float> out(90 * 3);
                CHECK_THROWS_AS(normals_from_slopes(heights, heights, 5, 18, 1.0, 1.0, false, out, 2, width),
                                NotFinite);
            }
        }
    }
}
