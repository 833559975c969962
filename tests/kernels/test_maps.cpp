// Map kernels without Python: what the sanitizers see runs here.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <stdexcept>
#include <vector>

#include "maps/codes.hpp"
#include "maps/color.hpp"
#include "maps/gutter.hpp"
#include "maps/mips.hpp"
#include "ramp.hpp"

using namespace paradize;

TEST_CASE("halving keeps the mean of any size") {
    for (std::size_t rows = 1; rows <= 7; ++rows) {
        for (std::size_t columns = 1; columns <= 7; ++columns) {
            const auto image = ramp(rows * columns * 2);
            std::vector<float> half(maps::half_size(rows) * maps::half_size(columns) * 2);
            maps::halve(image, {rows, 0, maps::half_size(rows)}, columns, 2, half, 2);
            double before = 0.0;
            double after = 0.0;
            for (std::size_t i = 0; i < image.size(); i += 2) {
                before += image[i] / static_cast<double>(rows * columns);
            }
            for (std::size_t i = 0; i < half.size(); i += 2) {
                after += half[i] / (static_cast<double>(half.size()) / 2.0);
            }
            CHECK(after == doctest::Approx(before).epsilon(1e-6));
        }
    }
}

TEST_CASE("every texel of a map finds a covered one, and none where there is none") {
    for (std::size_t rows = 1; rows <= 5; ++rows) {
        for (std::size_t columns = 1; columns <= 5; ++columns) {
            for (std::size_t seed = 0; seed < rows * columns; ++seed) {
                std::vector<std::uint8_t> covered(rows * columns, 0);
                std::vector<std::int32_t> source(rows * columns);
                maps::nearest_covered(covered, rows, columns, true, false, source, 2);
                for (const std::int32_t at : source) {
                    CHECK(at == -1);
                }
                covered[seed] = 1;
                maps::nearest_covered(covered, rows, columns, true, false, source, 2);
                for (const std::int32_t at : source) {
                    CHECK(at == static_cast<std::int32_t>(seed));
                }
            }
        }
    }
}

TEST_CASE("UVs that are no layout are refused and never leave the map") {
    const std::vector<std::uint32_t> triangle = {0, 1, 2};
    const std::vector<std::int32_t> ids = {0};
    std::vector<std::int32_t> out(64);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (const float far : {1e7F, 1e30F, nan}) {
        const std::vector<float> uvs = {0.0F, 0.0F, far, 0.0F, 0.0F, far};
        CHECK_THROWS_AS(maps::rasterise(uvs, triangle, ids, 8, 8, 1e6, out), std::length_error);
    }
    for (const float shift : {-3.0F, -0.5F, 0.0F, 0.999F, 1.0F, 17.25F}) {
        const std::vector<float> uvs = {shift, shift, shift + 1.0F, shift, shift, shift + 1.0F};
        maps::rasterise(uvs, triangle, ids, 8, 8, 1e6, out);
        CHECK(std::count(out.begin(), out.end(), 0) >= 36);
    }
}

TEST_CASE("colour survives linear light and back at every code") {
    std::vector<std::uint8_t> codes(256);
    std::vector<float> shares(256);
    for (std::size_t i = 0; i < 256; ++i) {
        codes[i] = static_cast<std::uint8_t>(i);
        shares[i] = static_cast<float>(i) / 255.0F;
    }
    std::vector<float> linear(256);
    std::vector<float> computed(256);
    maps::linear_light<std::uint8_t>(codes, 1, true, linear, 1);
    maps::linear_light<float>(shares, 1, true, computed, 1);
    std::vector<std::uint8_t> back(4 * 256);
    for (const std::vector<float> &light : {linear, computed}) {
        maps::rgba_codes<float>(light, 1, false, back, 2);
        for (std::size_t i = 0; i < 256; ++i) {
            CHECK(back[4 * i] == i);
            CHECK(back[4 * i + 2] == i);
            CHECK(back[4 * i + 3] == 255);
        }
    }
}

TEST_CASE("codes halved at once are what linear light halved is") {
    for (std::size_t channels = 1; channels <= 4; ++channels) {
        std::vector<std::uint8_t> codes(6 * 8 * channels);
        for (std::size_t i = 0; i < codes.size(); ++i) {
            codes[i] = static_cast<std::uint8_t>(i * 37 % 256);
        }
        std::vector<float> linear(codes.size());
        std::vector<float> halved(codes.size() / 4);
        std::vector<float> found(codes.size() / 4);
        maps::linear_light<std::uint8_t>(codes, channels, true, linear, 1);
        const maps::HalfRows half{6, 0, 3};
        (channels % 2 == 0 ? maps::halve_with_alpha : maps::halve)(linear, half, 8, channels, halved, 1);
        maps::halved_light(codes, 6, 8, channels, found, 2);
        for (std::size_t i = 0; i < found.size(); ++i) {
            CHECK(found[i] == doctest::Approx(halved[i]).epsilon(1e-6));
        }
    }
}

TEST_CASE("a band of rows is halved as the whole is") {
    for (const std::size_t rows : {1U, 2U, 7U, 12U, 13U}) {
        const std::vector<float> image = ramp(rows * 5 * 2);
        const std::size_t count = maps::half_size(rows);
        std::vector<float> whole(count * 2 * 2);
        maps::halve(image, {rows, 0, count}, 5, 2, whole, 1);
        for (std::size_t first = 0; first < count; ++first) {
            const maps::HalfRows half{rows, first, 1};
            std::vector<float> found(2 * 2);
            const std::span<const float> band{&image[2 * first * 5 * 2], maps::rows_below(half) * 5 * 2};
            maps::halve(band, half, 5, 2, found, 1);
            for (std::size_t i = 0; i < found.size(); ++i) {
                CHECK(found[i] == whole[first * 4 + i]);
            }
        }
    }
}

TEST_CASE("du/dv codes sum to zero whatever the values") {
    for (std::size_t count = 1; count <= 40; ++count) {
        std::vector<float> vectors = ramp(3 * count);
        for (float &value : vectors) {
            value = value * 2.6F - 1.3F; // beyond the range too
        }
        std::vector<std::int8_t> codes(2 * count);
        std::vector<std::int8_t> rest(2 * count);
        const std::array<double, 2> mean = {0.2, -0.4};
        maps::dudv_codes(vectors, mean, codes, rest, 1);
        maps::balance(codes, rest);
        for (std::size_t c = 0; c < 2; ++c) {
            int sum = 0;
            for (std::size_t i = 0; i < count; ++i) {
                sum += codes[2 * i + c];
            }
            CHECK(sum == 0);
        }
    }
}
