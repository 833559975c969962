// Block compression: 4 x 4 texels into 8 or 16 bytes.
// Layout: Microsoft, "Block Compression (Direct3D 10)", and Khronos, "Data Format Specification 1.3",
// chapters S3TC and RGTC. The decoder that is assumed interpolates exactly (the fractions of the Khronos
// specification, no rounding in between); GPUs that round differ from it by less than one 8-bit code.
// Methods: principal axis and least squares after S. Brown's description of "squish" (2006), here for as many
// blocks at once as a vector has lanes; the exact tier's search of every partition in closed form and the
// rounding of both ends together are our own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace paradize::bcn {

constexpr std::size_t blocks(std::size_t rows, std::size_t columns) {
    return ((rows + 3) / 4) * ((columns + 3) / 4);
}

// How much is searched. No block is worse at a higher one, in its sum of squares or at its worst texel.
enum class Quality { fast, balanced, exact };

// Texels anywhere in memory. channels: that are read; 3 or 4 for colour (3: alpha is 255), 1 or 2 for values.
// Strides are in bytes. Blocks at the right and lower edge repeat the last texel.
struct Texels {
    enum class Kind {
        unorm8,  // 0..255 is 0..1
        snorm8,  // -127..127 is -1..1; -128 is -127
        unorm16, // 0..65535 is 0..1
        float32, // 0..1 or -1..1; beyond is clamped, what is not a number is the least
    };
    const void *data = nullptr;
    Kind kind = Kind::unorm8;
    std::size_t rows = 0;
    std::size_t columns = 0;
    std::size_t channels = 0;
    std::ptrdiff_t row_stride = 0;
    std::ptrdiff_t texel_stride = 0;
};

// texels: unorm8, 3 or 4 channels of one byte after another. out: 8 bytes per block, always the four-colour
// mode, so that no texel is ever a hole.
void encode_bc1(const Texels &texels, Quality quality, std::span<std::uint8_t> out, int threads);

// The same with 16 bytes per block: alpha as BC4, then colour as BC1.
void encode_bc3(const Texels &texels, Quality quality, std::span<std::uint8_t> out, int threads);

// texels: 1 channel (BC4, 8 bytes per block) or 2 (BC5, 16 bytes per block: the first, then the second).
// is_signed: SNORM blocks, which is allowed for snorm8 and float32, and asked for by snorm8; -128 is never
// written.
void encode_values(const Texels &texels, bool is_signed, Quality quality, std::span<std::uint8_t> out,
                   int threads);

} // namespace paradize::bcn
