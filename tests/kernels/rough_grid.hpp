#pragma once
// Heights that repeat nothing, for tests of terrain.

#include <cstddef>
#include <cstdint>
#include <vector>

struct Grid {
    std::uint32_t width, height;
    std::vector<float> heights;
};

/// Noise of 0 to 4 metres in steps of 1/64: a linear congruential generator from `seed`.
inline Grid rough(std::uint32_t width, std::uint32_t height, std::uint32_t seed) {
    Grid grid{width, height, std::vector<float>(static_cast<std::size_t>(width) * height)};
    for (float &value : grid.heights) {
        seed = seed * 1664525U + 1013904223U;
        value = static_cast<float>(seed >> 24) / 64.0F;
    }
    return grid;
}
