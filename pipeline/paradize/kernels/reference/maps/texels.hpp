// Decodes a texture's bytes to floats as hardware does. For metrics only: shares nothing with the encoders.
// Source: Khronos, "Data Format Specification 1.3", chapters S3TC and RGTC: exact fractions, rounded once.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace paradize::reference {

enum class Texels {
    unorm8 = 0,
    snorm8 = 1,
    unorm16 = 2,
    snorm16 = 3,
    float32 = 4,
    bc1 = 5,
    bc3 = 6,
    bc4 = 7,
    bc5 = 8,
    bc5_signed = 9
};

struct Size {
    std::size_t rows;
    std::size_t columns;
};

// The size of a mip level: halves, rounded down, at least 1.
constexpr Size level_size(Size size, std::size_t level) {
    const std::size_t rows = size.rows >> level;
    const std::size_t columns = size.columns >> level;
    return {rows == 0 ? 1 : rows, columns == 0 ? 1 : columns};
}

// Bytes of a level of that size, tightly packed.
std::size_t level_bytes(Texels format, std::size_t channels, Size size);

// The rows of one level. Blocks are decoded a row of them at a time and kept until another is asked for.
class TexelRows {
  public:
    // data: level_bytes(format, channels, size) bytes. channels: of the plain formats; blocks know theirs.
    TexelRows(Texels format, std::size_t channels, Size size, std::span<const std::uint8_t> data);

    std::size_t channels() const { return channels_; }
    // Channel c of row y, `columns` floats; valid until a row elsewhere is asked for.
    const float *row(std::size_t y, std::size_t c);

  private:
    void decode_plain(std::size_t y);
    void decode_blocks(std::size_t y);

    Texels format_;
    std::size_t channels_;
    Size size_;
    std::span<const std::uint8_t> data_;
    std::size_t depth_;         // rows held at once: 1, or 4 of blocks
    std::size_t stride_;        // floats from row to row of a channel
    std::size_t first_;         // the first of the rows held
    std::vector<float> values_; // (channels, depth, stride)
};

} // namespace paradize::reference
