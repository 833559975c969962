// BC7: 4 x 4 texels of RGBA into 16 bytes.
// Layout: Khronos, "Data Format Specification 1.3", chapter BPTC. The search is our own; bc7/fit.hpp and
// bc7/axis.hpp name what it stands on.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace paradize::bc7 {

enum class Quality { fast, balanced, exact };

constexpr std::size_t blocks(std::size_t rows, std::size_t columns) {
    return ((rows + 3) / 4) * ((columns + 3) / 4);
}

// rgba: rows * columns * 4 bytes, straight alpha. out: 16 bytes per block, row by row. What is made
// small is the squared error over all four channels, where that of alpha counts alpha_weight (1 to 64) times;
// opaque blocks stay opaque and blocks of one colour are exact.
// Blocks at the right and lower edge repeat the last texel.
void encode(std::span<const std::uint8_t> rgba, std::size_t rows, std::size_t columns, Quality quality,
            float alpha_weight, std::span<std::uint8_t> out, int threads);

} // namespace paradize::bc7
