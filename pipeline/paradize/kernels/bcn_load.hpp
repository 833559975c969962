// Texels from memory into lanes: 4 * lanes texels of each of the four rows of a row of blocks.
#pragma once

#include "bcn_encode.hpp"
#include "bcn_single.hpp"

namespace paradize::bcn::PARADIZE_WIDTH {

constexpr std::size_t span = 4 * lanes; // texels of a row that are taken at once

// The first of `span` texels of one row of the image; rows beyond the last repeat it.
PARADIZE_INLINE const std::uint8_t *texel_at(const Texels &from, std::size_t row, std::size_t column) {
    const std::size_t y = row < from.rows ? row : from.rows - 1;
    return static_cast<const std::uint8_t *>(from.data) + static_cast<std::ptrdiff_t>(y) * from.row_stride +
           static_cast<std::ptrdiff_t>(column) * from.texel_stride;
}

// Red in the lowest byte of a word.
PARADIZE_STEP void read_colors(const Texels &from, std::size_t row, std::size_t column, std::int32_t *out) {
    const std::uint8_t *at = texel_at(from, row, column);
    const std::size_t here = from.columns - column < span ? from.columns - column : span;
    for (std::size_t i = 0; i < span; ++i) {
        const std::uint8_t *texel =
            at + static_cast<std::ptrdiff_t>(i < here ? i : here - 1) * from.texel_stride;
        const std::uint32_t alpha = from.channels == 4 ? texel[3] : 255U;
        out[i] = static_cast<std::int32_t>(texel[0] | static_cast<std::uint32_t>(texel[1]) << 8 |
                                           static_cast<std::uint32_t>(texel[2]) << 16 | alpha << 24);
    }
}

// Words of the texels of `lanes` blocks from block column `column` / 4 of block row `row` / 4.
PARADIZE_STEP void load_colors(const Texels &from, std::size_t row, std::size_t column,
                               Whole (&words)[texels]) {
    const bool straight = from.texel_stride == 4 && from.channels == 4 && from.columns - column >= span;
    for (std::size_t y = 0; y < 4; ++y) {
        Whole line[4];
        if (straight) {
            std::memcpy(line, texel_at(from, row + y, column), sizeof(line));
        } else {
            std::int32_t some[span];
            read_colors(from, row + y, column, some);
            std::memcpy(line, some, sizeof(line));
        }
        Whole four[4];
        every_fourth(line, four);
        for (std::size_t x = 0; x < 4; ++x) {
            words[4 * y + x] = four[x];
        }
    }
}

template <typename T, std::ptrdiff_t Stride, std::size_t Channels>
PARADIZE_INLINE void convert(const std::uint8_t *at, float scale, float bottom, float top,
                             float (*out)[span]) {
    for (std::size_t i = 0; i < span; ++i) {
        for (std::size_t c = 0; c < Channels; ++c) {
            T value;
            std::memcpy(&value,
                        at + (static_cast<std::ptrdiff_t>(i) * Stride + static_cast<std::ptrdiff_t>(c)) *
                                 static_cast<std::ptrdiff_t>(sizeof(T)),
                        sizeof(T));
            const float code = static_cast<float>(value) * scale;
            const float above = code > bottom ? code : bottom;
            out[c][i] = above < top ? above : top;
        }
    }
}

template <typename T, std::size_t Channels>
PARADIZE_STEP void read_values(const Texels &from, std::size_t row, std::size_t column, float scale,
                               float bottom, float top, float (*out)[span]) {
    const std::uint8_t *at = texel_at(from, row, column);
    constexpr auto size = static_cast<std::ptrdiff_t>(sizeof(T));
    if (from.columns - column >= span) {
        switch (from.texel_stride) {
        case size:
            if constexpr (Channels == 1) {
                return convert<T, 1, Channels>(at, scale, bottom, top, out);
            }
            break;
        case 2 * size:
            return convert<T, 2, Channels>(at, scale, bottom, top, out);
        case 3 * size:
            return convert<T, 3, Channels>(at, scale, bottom, top, out);
        case 4 * size:
            return convert<T, 4, Channels>(at, scale, bottom, top, out);
        default:
            break;
        }
    }
    T some[2 * span];
    const std::size_t here = from.columns - column < span ? from.columns - column : span;
    for (std::size_t i = 0; i < span; ++i) {
        std::memcpy(&some[Channels * i],
                    at + static_cast<std::ptrdiff_t>(i < here ? i : here - 1) * from.texel_stride,
                    Channels * sizeof(T));
    }
    convert<T, Channels, Channels>(reinterpret_cast<const std::uint8_t *>(some), scale, bottom, top, out);
}

// Codes of the texels of `lanes` blocks; top: 255, or 127 for SNORM.
template <std::size_t Channels>
PARADIZE_STEP void load_values(const Texels &from, std::size_t row, std::size_t column, float bottom,
                               float top, ValueBlocks (&blocks)[Channels]) {
    for (std::size_t y = 0; y < 4; ++y) {
        float planes[Channels][span];
        switch (from.kind) {
        case Texels::Kind::unorm8:
            read_values<std::uint8_t, Channels>(from, row + y, column, 1.0F, bottom, top, planes);
            break;
        case Texels::Kind::snorm8:
            read_values<std::int8_t, Channels>(from, row + y, column, 1.0F, bottom, top, planes);
            break;
        case Texels::Kind::unorm16:
            read_values<std::uint16_t, Channels>(from, row + y, column, 255.0F / 65535.0F, bottom, top,
                                                 planes);
            break;
        case Texels::Kind::float32:
            read_values<float, Channels>(from, row + y, column, top, bottom, top, planes);
            break;
        }
        for (std::size_t c = 0; c < Channels; ++c) {
            Lanes line[4];
            std::memcpy(line, planes[c], sizeof(line));
            Lanes four[4];
            every_fourth(line, four);
            for (std::size_t x = 0; x < 4; ++x) {
                blocks[c].v[4 * y + x] = four[x];
            }
        }
    }
}

} // namespace paradize::bcn::PARADIZE_WIDTH
