// Block compression without Python: one CPU's bits are every CPU's, and small blocks decode to what went in.
#include <doctest/doctest.h>

#include <cstdint>
#include <vector>

#include "bcn_encode.hpp"
#include "bcn_solid.hpp"

using namespace paradize;

namespace paradize::bcn {
#define PARADIZE_ROWS(width)                                                                                 \
    namespace width {                                                                                        \
    void color_row(const std::uint8_t *, std::size_t, std::size_t, std::size_t, bool, int,                   \
                   const SolidTables &, std::uint8_t *);                                                     \
    void single_row(const float *, std::size_t, std::size_t, std::size_t, std::size_t, bool, int,            \
                    std::uint8_t *);                                                                         \
    }
PARADIZE_ROWS(baseline)
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define PARADIZE_WIDE 1
PARADIZE_ROWS(avx2)
PARADIZE_ROWS(avx512)
#endif
} // namespace paradize::bcn

namespace {

// A fixed sequence of bytes: smooth on one half, noise on the other.
std::vector<std::uint8_t> pixels(std::size_t rows, std::size_t columns) {
    std::vector<std::uint8_t> out(rows * columns * 4);
    std::uint32_t state = 12345;
    for (std::size_t i = 0; i < out.size(); ++i) {
        state = state * 1664525U + 1013904223U;
        const std::size_t x = i / 4 % columns;
        out[i] = static_cast<std::uint8_t>(x < columns / 2 ? x * 5 + i / (4 * columns) * 3 : state >> 24);
    }
    return out;
}

std::vector<float> values(std::size_t count) {
    const std::vector<std::uint8_t> bytes = pixels(count, 1);
    std::vector<float> out(count);
    for (std::size_t i = 0; i < count; ++i) {
        out[i] = static_cast<float>(bytes[i]) / 127.5F - 1.0F;
    }
    return out;
}

} // namespace

#ifdef PARADIZE_WIDE
TEST_CASE("every instruction set gives the same blocks") {
    const std::size_t rows = 4;
    const std::size_t columns = 256;
    const auto rgba = pixels(rows, columns);
    const auto floats = values(rows * columns * 2);
    const bcn::SolidTables solid;
    const auto run = [&](auto color, auto single) {
        std::vector<std::uint8_t> out(columns / 4 * 32);
        color(rgba.data(), 0, rows, columns, true, 2, solid, out.data());
        single(floats.data(), 2, 0, rows, columns, true, 2, out.data() + columns / 4 * 16);
        return out;
    };
    const auto baseline = run(&bcn::baseline::color_row, &bcn::baseline::single_row);
    if (__builtin_cpu_supports("avx2")) {
        CHECK(run(&bcn::avx2::color_row, &bcn::avx2::single_row) == baseline);
    }
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw")) {
        CHECK(run(&bcn::avx512::color_row, &bcn::avx512::single_row) == baseline);
    }
}
#endif

TEST_CASE("more searching never makes a block worse") {
    const std::size_t size = 64;
    const auto floats = values(size * size);
    double last = 1e30;
    for (int passes = 0; passes <= 4; ++passes) {
        std::vector<std::uint8_t> out(bcn::blocks(size, size) * 8);
        bcn::encode_bc4(floats, size, size, true, passes, out, 1);
        double error = 0.0;
        for (std::size_t block = 0; block < bcn::blocks(size, size); ++block) {
            const std::uint8_t *data = &out[block * 8];
            const int a = static_cast<std::int8_t>(data[0]);
            const int b = static_cast<std::int8_t>(data[1]);
            std::uint64_t bits = 0;
            for (int i = 5; i >= 0; --i) {
                bits = bits << 8 | data[2 + i];
            }
            for (std::size_t i = 0; i < 16; ++i) {
                const int index = static_cast<int>(bits >> (3 * i) & 7);
                double decoded = index == 0 ? a : b;
                if (a > b && index > 1) {
                    decoded = ((8 - index) * a + (index - 1) * b) / 7.0;
                } else if (a <= b && index > 1) {
                    decoded = index == 6 ? -127.0
                                         : (index == 7 ? 127.0 : ((6 - index) * a + (index - 1) * b) / 5.0);
                }
                const std::size_t y = block / (size / 4) * 4 + i / 4;
                const std::size_t x = block % (size / 4) * 4 + i % 4;
                const double gap = decoded - static_cast<double>(floats[y * size + x]) * 127.0;
                error += gap * gap;
            }
        }
        CHECK(error <= last);
        last = error;
    }
    CHECK(last / (size * size) < 400.0);
}

TEST_CASE("a flat block is exact where its value is a code") {
    for (int code = -127; code <= 127; ++code) {
        const std::vector<float> flat(16, static_cast<float>(code) / 127.0F);
        std::vector<std::uint8_t> out(8);
        bcn::encode_bc4(flat, 4, 4, true, 2, out, 1);
        const int a = static_cast<std::int8_t>(out[0]);
        const int b = static_cast<std::int8_t>(out[1]);
        const int index = out[2] & 7;
        CHECK((index == 0 ? a : b) == code);
        CHECK(index <= 1);
    }
}
