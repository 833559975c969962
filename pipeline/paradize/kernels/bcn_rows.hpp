// Whole rows of blocks, compiled once per instruction set: include after defining PARADIZE_WIDTH.
#pragma once

#include "bcn_color.hpp"
#include "bcn_single.hpp"

namespace paradize::bcn::PARADIZE_WIDTH {

// Where texel i of a block lies; the last row and column repeat beyond the edge.
PARADIZE_INLINE std::size_t texel_at(std::size_t row, std::size_t column, std::size_t i, std::size_t rows,
                                     std::size_t columns) {
    const std::size_t y = 4 * row + i / 4;
    const std::size_t x = 4 * column + i % 4;
    return (y < rows ? y : rows - 1) * columns + (x < columns ? x : columns - 1);
}

// One row of blocks of rgba bytes -> BC1, or BC3 with alpha.
void color_row(const std::uint8_t *rgba, std::size_t row, std::size_t rows, std::size_t columns,
               bool with_alpha, int passes, const SolidTables &solid, std::uint8_t *out) {
    for (std::size_t column = 0; column < (columns + 3) / 4; ++column) {
        ColorBlock block;
        Lanes alpha;
        for (std::size_t i = 0; i < texels; ++i) {
            const std::uint8_t *texel = rgba + 4 * texel_at(row, column, i, rows, columns);
            block.v[0][i] = static_cast<float>(texel[0]);
            block.v[1][i] = static_cast<float>(texel[1]);
            block.v[2][i] = static_cast<float>(texel[2]);
            alpha[i] = static_cast<float>(texel[3]);
        }
        if (with_alpha) {
            encode_single(alpha, {0.0F, 255.0F}, passes, out);
            out += 8;
        }
        encode_color(block, solid, passes, out);
        out += 8;
    }
}

// One row of blocks of one or two channels of floats -> BC4 or BC5.
void single_row(const float *values, std::size_t channels, std::size_t row, std::size_t rows,
                std::size_t columns, bool is_signed, int passes, std::uint8_t *out) {
    const CodeRange range = is_signed ? CodeRange{-127.0F, 127.0F} : CodeRange{0.0F, 255.0F};
    for (std::size_t column = 0; column < (columns + 3) / 4; ++column) {
        for (std::size_t c = 0; c < channels; ++c) {
            Lanes v;
            for (std::size_t i = 0; i < texels; ++i) {
                const float code = values[channels * texel_at(row, column, i, rows, columns) + c] * range.top;
                v[i] = code < range.bottom ? range.bottom : (code > range.top ? range.top : code);
            }
            encode_single(v, range, passes, out);
            out += 8;
        }
    }
}

} // namespace paradize::bcn::PARADIZE_WIDTH
