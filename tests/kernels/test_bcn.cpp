// Block compression without Python: one CPU's bits are every CPU's, a higher tier is never worse, and small
// blocks decode to what went in. The decoders here share nothing with the encoders.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "bcn/encode.hpp"
#include "bcn/widths.hpp"

using namespace paradize;
using bcn::Quality;
using bcn::Texels;

namespace {

constexpr std::array qualities = {Quality::fast, Quality::balanced, Quality::exact};

// A fixed sequence of bytes: smooth on one half, noise on the other, a few at the ends of the range.
std::vector<std::uint8_t> pixels(std::size_t rows, std::size_t columns) {
    std::vector<std::uint8_t> out(rows * columns * 4);
    std::uint32_t state = 12345;
    for (std::size_t i = 0; i < out.size(); ++i) {
        state = state * 1664525U + 1013904223U;
        const std::size_t x = i / 4 % columns;
        const std::uint32_t noise = state >> 24;
        const std::size_t smooth = x * 5 + i / (4 * columns) * 3 + i % 4 * 20;
        out[i] = static_cast<std::uint8_t>(x < columns / 2 ? smooth
                                           : noise < 40    ? 0
                                           : noise > 230   ? 255
                                                           : noise);
    }
    return out;
}

std::vector<float> values(std::size_t count) {
    const std::vector<std::uint8_t> bytes = pixels(count / 64, 64);
    std::vector<float> out(count);
    for (std::size_t i = 0; i < count; ++i) {
        out[i] = static_cast<float>(bytes[i % bytes.size()]) / 127.5F - 1.0F;
    }
    return out;
}

Texels of(const std::vector<std::uint8_t> &rgba, std::size_t rows, std::size_t columns) {
    return {rgba.data(), Texels::Kind::unorm8, rows, columns, 4, static_cast<std::ptrdiff_t>(columns * 4), 4};
}

Texels of(const std::vector<float> &floats, std::size_t rows, std::size_t columns, std::size_t channels) {
    const auto texel = static_cast<std::ptrdiff_t>(channels * sizeof(float));
    return {floats.data(), Texels::Kind::float32,
            rows,          columns,
            channels,      static_cast<std::ptrdiff_t>(columns) * texel,
            texel};
}

// Value of texel i of a BC4 SNORM block, in codes.
double decoded_value(const std::uint8_t *data, std::size_t i) {
    const int a = static_cast<std::int8_t>(data[0]);
    const int b = static_cast<std::int8_t>(data[1]);
    std::uint64_t bits = 0;
    for (int at = 5; at >= 0; --at) {
        bits = bits << 8 | data[2 + at];
    }
    const int index = static_cast<int>(bits >> (3 * i) & 7);
    if (index < 2) {
        return index == 0 ? a : b;
    }
    if (a > b) {
        return ((8 - index) * a + (index - 1) * b) / 7.0;
    }
    return index == 6 ? -127.0 : index == 7 ? 127.0 : ((6 - index) * a + (index - 1) * b) / 5.0;
}

// Channel k of texel i of a four-colour BC1 block, 0..255.
double decoded_color(const std::uint8_t *data, std::size_t i, int k) {
    const int shift[3] = {11, 5, 0};
    const int top[3] = {31, 63, 31};
    const auto end = [&](int at) {
        const int word = data[at] | data[at + 1] << 8;
        return (word >> shift[k] & top[k]) * 255.0 / top[k];
    };
    const double a = end(0);
    const double b = end(2);
    const std::uint32_t bits =
        data[4] | data[5] << 8 | data[6] << 16 | static_cast<std::uint32_t>(data[7]) << 24;
    const std::uint32_t index = bits >> (2 * i) & 3;
    return index == 0 ? a : index == 1 ? b : index == 2 ? (2 * a + b) / 3 : (a + 2 * b) / 3;
}

std::vector<std::uint8_t> encoded(const Texels &texels, Quality quality, bool with_alpha = false) {
    std::vector<std::uint8_t> out(bcn::blocks(texels.rows, texels.columns) * (with_alpha ? 16 : 8));
    (with_alpha ? bcn::encode_bc3 : bcn::encode_bc1)(texels, quality, out, 1);
    return out;
}

std::vector<std::uint8_t> encoded_values(const Texels &texels, bool is_signed, Quality quality) {
    std::vector<std::uint8_t> out(bcn::blocks(texels.rows, texels.columns) * 8 * texels.channels);
    bcn::encode_values(texels, is_signed, quality, out, 1);
    return out;
}

} // namespace

#ifdef PARADIZE_WIDE
TEST_CASE("every instruction set gives the same blocks") {
    for (const std::size_t columns : {std::size_t{256}, std::size_t{30}}) {
        const std::size_t rows = 7;
        const auto rgba = pixels(rows, columns);
        const auto floats = values(64 * 64 * 2);
        const std::size_t across = (columns + 3) / 4;
        for (const Quality quality : qualities) {
            const auto run = [&](auto color, auto value) {
                std::vector<std::uint8_t> out(across * 48);
                color(of(rgba, rows, columns), 1, true, quality, out.data());
                value(of(floats, rows, columns, 2), 1, true, quality, out.data() + across * 16);
                color(of(rgba, rows, columns), 0, false, quality, out.data() + across * 32);
                const auto stride = static_cast<std::ptrdiff_t>(columns);
                value({rgba.data(), Texels::Kind::unorm8, rows, columns, 1, stride, 1}, 0, false, quality,
                      out.data() + across * 40);
                return out;
            };
            const auto baseline = run(&bcn::baseline::color_row, &bcn::baseline::value_row);
            if (has_avx2()) {
                CHECK(run(&bcn::avx2::color_row, &bcn::avx2::value_row) == baseline);
            }
            if (has_avx512()) {
                CHECK(run(&bcn::avx512::color_row, &bcn::avx512::value_row) == baseline);
            }
        }
    }
}
#endif

TEST_CASE("no block of values is worse at a higher tier, in sum or at its worst texel") {
    const std::size_t size = 64;
    const auto floats = values(size * size);
    std::vector<double> last(size * size / 16, 1e30);
    std::vector<double> last_worst(size * size / 16, 1e30);
    for (const Quality quality : qualities) {
        const auto out = encoded_values(of(floats, size, size, 1), true, quality);
        for (std::size_t block = 0; block < last.size(); ++block) {
            double error = 0.0;
            double worst = 0.0;
            for (std::size_t i = 0; i < 16; ++i) {
                const std::size_t y = block / (size / 4) * 4 + i / 4;
                const std::size_t x = block % (size / 4) * 4 + i % 4;
                const double gap =
                    decoded_value(&out[8 * block], i) - static_cast<double>(floats[y * size + x]) * 127.0;
                error += gap * gap;
                worst = std::max(worst, std::abs(gap));
            }
            CHECK(error <= last[block] + 0.05); // sums in single precision
            last[block] = error;
            CHECK(worst <= last_worst[block] + 1e-3);
            last_worst[block] = worst;
        }
    }
}

TEST_CASE("no block of colours is worse at a higher tier, in sum or at its worst texel") {
    const std::size_t size = 64;
    const auto rgba = pixels(size, size);
    std::vector<double> last(size * size / 16, 1e30);
    std::vector<double> last_worst(size * size / 16, 1e30);
    for (const Quality quality : qualities) {
        const auto out = encoded(of(rgba, size, size), quality);
        for (std::size_t block = 0; block < last.size(); ++block) {
            double error = 0.0;
            double worst = 0.0;
            for (std::size_t i = 0; i < 48; ++i) {
                const std::size_t y = block / (size / 4) * 4 + i / 12;
                const std::size_t x = block % (size / 4) * 4 + i / 3 % 4;
                const double gap = decoded_color(&out[8 * block], i / 3, static_cast<int>(i % 3)) -
                                   rgba[4 * (y * size + x) + i % 3];
                error += gap * gap;
                worst = std::max(worst, std::abs(gap));
            }
            CHECK(error <= last[block] * 1.000001 + 0.5);
            last[block] = error;
            CHECK(worst <= last_worst[block] + 1e-3);
            last_worst[block] = worst;
        }
    }
}

TEST_CASE("a flat block is exact where its value is a code") {
    for (const Quality quality : qualities) {
        for (int code = -127; code <= 127; ++code) {
            const std::vector<float> flat(16, static_cast<float>(code) / 127.0F);
            const auto out = encoded_values(of(flat, 4, 4, 1), true, quality);
            CHECK(std::abs(decoded_value(out.data(), 5) - code) < 1e-9);
            CHECK((out[2] & 7) <= 1);
        }
    }
}

TEST_CASE("a block of one colour is the best that two ends can make") {
    double best[2][256]; // nearest to a code, of 5 and 6 bits
    for (int bits = 0; bits < 2; ++bits) {
        const int top = bits == 0 ? 31 : 63;
        for (int code = 0; code < 256; ++code) {
            best[bits][code] = 1e9;
            for (int thirds = 0; thirds <= 3 * top; ++thirds) {
                best[bits][code] = std::min(best[bits][code], std::abs(thirds * 85.0 / top - code));
            }
        }
    }
    for (const Quality quality : qualities) {
        for (int code = 0; code < 256; ++code) {
            const std::array<int, 3> color = {code, (code * 7 + 31) % 256, 255 - code};
            std::vector<std::uint8_t> rgba(64, 255);
            for (std::size_t i = 0; i < 48; ++i) {
                rgba[i / 3 * 4 + i % 3] = static_cast<std::uint8_t>(color[i % 3]);
            }
            const auto out = encoded(of(rgba, 4, 4), quality);
            for (int k = 0; k < 3; ++k) {
                const double gap =
                    std::abs(decoded_color(out.data(), 9, k) - color[static_cast<std::size_t>(k)]);
                CHECK(gap <= best[k == 1 ? 1 : 0][color[static_cast<std::size_t>(k)]] + 1e-4);
            }
        }
    }
}

TEST_CASE("-128 is never written, and what is not a number is the least") {
    std::vector<float> wild = values(256);
    wild[3] = -40.0F;
    wild[77] = std::numeric_limits<float>::quiet_NaN();
    wild[130] = std::numeric_limits<float>::infinity();
    wild[200] = -std::numeric_limits<float>::infinity();
    for (const Quality quality : qualities) {
        const auto out = encoded_values(of(wild, 16, 16, 1), true, quality);
        for (std::size_t block = 0; block < 16; ++block) {
            CHECK(out[8 * block] != 128);
            CHECK(out[8 * block + 1] != 128);
        }
    }
    const std::vector<std::int8_t> least(16, -128);
    const Texels codes{least.data(), Texels::Kind::snorm8, 4, 4, 1, 4, 1};
    CHECK(decoded_value(encoded_values(codes, true, Quality::balanced).data(), 0) == -127.0);
}

TEST_CASE("alpha 0 and 255 are exact beside anything") {
    auto rgba = pixels(32, 32);
    for (const Quality quality : qualities) {
        const auto out = encoded(of(rgba, 32, 32), quality, true);
        for (std::size_t block = 0; block < 64; ++block) {
            const std::uint8_t *data = &out[16 * block];
            std::uint64_t bits = 0;
            for (int at = 5; at >= 0; --at) {
                bits = bits << 8 | data[2 + at];
            }
            bool ends = true; // alpha of this block is 0 and 255 only
            for (std::size_t i = 0; i < 16; ++i) {
                const std::size_t y = block / 8 * 4 + i / 4, x = block % 8 * 4 + i % 4;
                const int alpha = rgba[4 * (y * 32 + x) + 3];
                ends = ends && (alpha == 0 || alpha == 255);
            }
            for (std::size_t i = 0; ends && i < 16; ++i) {
                const std::size_t y = block / 8 * 4 + i / 4, x = block % 8 * 4 + i % 4;
                const int index = static_cast<int>(bits >> (3 * i) & 7);
                const int a = data[0], b = data[1];
                const int alpha = index == 0             ? a
                                  : index == 1           ? b
                                  : a <= b && index == 6 ? 0
                                  : a <= b && index == 7 ? 255
                                                         : -1;
                CHECK(alpha == rgba[4 * (y * 32 + x) + 3]);
            }
        }
        for (std::size_t i = 3; i < rgba.size(); i += 4) {
            rgba[i] = rgba[i] < 128 ? 0 : 255;
        }
    }
}
