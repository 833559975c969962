// A picture's texels by block; beyond the right and lower edge the last texel repeats.
#pragma once

#include <cstddef>
#include <cstdint>

namespace paradize::bc7 {

struct Picture {
    const std::uint8_t *rgba; // rows * columns * 4
    std::size_t rows;
    std::size_t columns;

    std::size_t across() const { return (columns + 3) / 4; }
    std::size_t down() const { return (rows + 3) / 4; }

    // Red in the lowest byte.
    __attribute__((always_inline)) inline std::uint32_t texel(std::size_t row, std::size_t column,
                                                              int t) const {
        const std::size_t y = 4 * row + static_cast<std::size_t>(t / 4);
        const std::size_t x = 4 * column + static_cast<std::size_t>(t % 4);
        const std::uint8_t *at =
            rgba + 4 * ((y < rows ? y : rows - 1) * columns + (x < columns ? x : columns - 1));
        return static_cast<std::uint32_t>(at[0]) | static_cast<std::uint32_t>(at[1]) << 8 |
               static_cast<std::uint32_t>(at[2]) << 16 | static_cast<std::uint32_t>(at[3]) << 24;
    }
};

} // namespace paradize::bc7
