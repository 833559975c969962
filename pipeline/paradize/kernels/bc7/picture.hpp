// A picture's texels by block; beyond the right and lower edge the last texel repeats.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

namespace paradize::bc7 {

struct Picture {
    const std::uint8_t *rgba; // rows * columns * 4
    std::size_t rows;
    std::size_t columns;

    std::size_t across() const { return (columns + 3) / 4; }
    std::size_t down() const { return (rows + 3) / 4; }

    // The sixteen texels of a block, red in the lowest byte.
    __attribute__((always_inline)) inline void block(std::size_t row, std::size_t column,
                                                     std::uint32_t *out) const {
        if (std::endian::native == std::endian::little && 4 * row + 4 <= rows && 4 * column + 4 <= columns) {
            const std::uint8_t *from = rgba + 4 * (4 * row * columns + 4 * column);
            for (std::size_t y = 0; y < 4; ++y) {
                __builtin_memcpy(out + 4 * y, from + 4 * y * columns, 16);
            }
            return;
        }
        for (std::size_t t = 0; t < 16; ++t) {
            const std::size_t y = 4 * row + t / 4;
            const std::size_t x = 4 * column + t % 4;
            const std::uint8_t *at =
                rgba + 4 * ((y < rows ? y : rows - 1) * columns + (x < columns ? x : columns - 1));
            out[t] = static_cast<std::uint32_t>(at[0]) | static_cast<std::uint32_t>(at[1]) << 8 |
                     static_cast<std::uint32_t>(at[2]) << 16 | static_cast<std::uint32_t>(at[3]) << 24;
        }
    }
};

} // namespace paradize::bc7
