// Block compression: 4 x 4 texels into 8 or 16 bytes.
// Layout: Microsoft, "Block Compression (Direct3D 10)", and Khronos, "Data Format Specification 1.3",
// chapters S3TC and RGTC. Methods: principal axis and least squares after S. Brown's description of "squish"
// (2006); the search around the endpoints is our own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace paradize::bcn {

constexpr std::size_t blocks(std::size_t rows, std::size_t columns) {
    return ((rows + 3) / 4) * ((columns + 3) / 4);
}

// passes, 0..4: how often the neighbourhood of the endpoints is searched; more is slower and never worse.
// Blocks at the right and lower edge repeat the last texel. All sizes are of the image, in texels.

// rgba: rows * columns * 4 bytes; alpha is ignored. out: 8 bytes per block, always the four-colour mode.
void encode_bc1(std::span<const std::uint8_t> rgba, std::size_t rows, std::size_t columns, int passes,
                std::span<std::uint8_t> out, int threads);

// rgba: rows * columns * 4 bytes. out: 16 bytes per block: alpha as BC4, then colour as BC1.
void encode_bc3(std::span<const std::uint8_t> rgba, std::size_t rows, std::size_t columns, int passes,
                std::span<std::uint8_t> out, int threads);

// values: rows * columns floats, 0..1, or -1..1 where is_signed. out: 8 bytes per block.
void encode_bc4(std::span<const float> values, std::size_t rows, std::size_t columns, bool is_signed,
                int passes, std::span<std::uint8_t> out, int threads);

// values: rows * columns * 2 floats. out: 16 bytes per block: the first channel as BC4, then the second.
void encode_bc5(std::span<const float> values, std::size_t rows, std::size_t columns, bool is_signed,
                int passes, std::span<std::uint8_t> out, int threads);

} // namespace paradize::bcn
