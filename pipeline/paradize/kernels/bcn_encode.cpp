#include "bcn_encode.hpp"

#include "bcn_color.hpp"
#include "bcn_single.hpp"
#include "maps_parallel.hpp"

#include <algorithm>

namespace paradize::bcn {
namespace {

// Where texel i of the block at (row, column) of blocks lies; the last row and column repeat beyond the edge.
PARADIZE_INLINE std::size_t texel_at(std::size_t block_row, std::size_t block_column, std::size_t i,
                                     std::size_t rows, std::size_t columns) {
    const std::size_t y = std::min(4 * block_row + i / 4, rows - 1);
    const std::size_t x = std::min(4 * block_column + i % 4, columns - 1);
    return y * columns + x;
}

PARADIZE_INLINE void load_color(const std::uint8_t *rgba, std::size_t row, std::size_t column,
                                std::size_t rows, std::size_t columns, ColorBlock &block, Lanes &alpha) {
    for (std::size_t i = 0; i < texels; ++i) {
        const std::uint8_t *texel = rgba + 4 * texel_at(row, column, i, rows, columns);
        for (std::size_t k = 0; k < 3; ++k) {
            block.v[k][i] = static_cast<float>(texel[k]);
        }
        alpha[i] = static_cast<float>(texel[3]);
    }
}

PARADIZE_INLINE void load_single(const float *values, std::size_t stride, std::size_t row, std::size_t column,
                                 std::size_t rows, std::size_t columns, CodeRange range, Lanes &v) {
    for (std::size_t i = 0; i < texels; ++i) {
        const float code = values[stride * texel_at(row, column, i, rows, columns)] * range.top;
        v[i] = code < range.bottom ? range.bottom : (code > range.top ? range.top : code);
    }
}

PARADIZE_CLONES void color_row(const std::uint8_t *rgba, std::size_t row, std::size_t rows,
                               std::size_t columns, bool with_alpha, const SolidTables &solid,
                               std::uint8_t *out) {
    for (std::size_t column = 0; column < (columns + 3) / 4; ++column) {
        ColorBlock block;
        Lanes alpha;
        load_color(rgba, row, column, rows, columns, block, alpha);
        if (with_alpha) {
            encode_single(alpha, {0.0F, 255.0F}, out);
            out += 8;
        }
        encode_color(block, solid, out);
        out += 8;
    }
}

PARADIZE_CLONES void single_row(const float *values, std::size_t channels, std::size_t row, std::size_t rows,
                                std::size_t columns, CodeRange range, std::uint8_t *out) {
    for (std::size_t column = 0; column < (columns + 3) / 4; ++column) {
        for (std::size_t c = 0; c < channels; ++c) {
            Lanes v;
            load_single(values + c, channels, row, column, rows, columns, range, v);
            encode_single(v, range, out);
            out += 8;
        }
    }
}

void encode_colors(std::span<const std::uint8_t> rgba, std::size_t rows, std::size_t columns, bool with_alpha,
                   std::span<std::uint8_t> out, int threads) {
    const SolidTables &solid = solid_tables();
    const std::size_t row_bytes = ((columns + 3) / 4) * (with_alpha ? 16 : 8);
    maps::for_rows((rows + 3) / 4, threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t row = first; row < last; ++row) {
            color_row(rgba.data(), row, rows, columns, with_alpha, solid, &out[row * row_bytes]);
        }
    });
}

void encode_singles(std::span<const float> values, std::size_t channels, std::size_t rows,
                    std::size_t columns, bool is_signed, std::span<std::uint8_t> out, int threads) {
    const CodeRange range = is_signed ? CodeRange{-127.0F, 127.0F} : CodeRange{0.0F, 255.0F};
    const std::size_t row_bytes = ((columns + 3) / 4) * 8 * channels;
    maps::for_rows((rows + 3) / 4, threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t row = first; row < last; ++row) {
            single_row(values.data(), channels, row, rows, columns, range, &out[row * row_bytes]);
        }
    });
}

} // namespace

void encode_bc1(std::span<const std::uint8_t> rgba, std::size_t rows, std::size_t columns,
                std::span<std::uint8_t> out, int threads) {
    encode_colors(rgba, rows, columns, false, out, threads);
}

void encode_bc3(std::span<const std::uint8_t> rgba, std::size_t rows, std::size_t columns,
                std::span<std::uint8_t> out, int threads) {
    encode_colors(rgba, rows, columns, true, out, threads);
}

void encode_bc4(std::span<const float> values, std::size_t rows, std::size_t columns, bool is_signed,
                std::span<std::uint8_t> out, int threads) {
    encode_singles(values, 1, rows, columns, is_signed, out, threads);
}

void encode_bc5(std::span<const float> values, std::size_t rows, std::size_t columns, bool is_signed,
                std::span<std::uint8_t> out, int threads) {
    encode_singles(values, 2, rows, columns, is_signed, out, threads);
}

} // namespace paradize::bcn
