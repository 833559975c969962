// Texels from memory into lanes: 4 * lanes texels of each of the four rows of a row of blocks.
#pragma once

#include "bcn/encode.hpp"
#include "bcn/single.hpp"

namespace paradize::bcn::PARADIZE_WIDTH {

constexpr std::size_t span = 4 * lanes;  // texels of a row that are taken at once
constexpr std::size_t prefetched = 2048; // bytes ahead

// The first of `span` texels of one row of the image; rows beyond the last repeat it.
PARADIZE_INLINE const std::uint8_t *texel_at(const Texels &from, std::size_t row, std::size_t column) {
    const std::size_t y = row < from.rows ? row : from.rows - 1;
    return static_cast<const std::uint8_t *>(from.data) + static_cast<std::ptrdiff_t>(y) * from.row_stride +
           static_cast<std::ptrdiff_t>(column) * from.texel_stride;
}

// Asks for what comes after these bytes of a row, which the CPU does not see coming: memory's pages end, and
// four rows are read in turns.
PARADIZE_INLINE void fetch_ahead(const std::uint8_t *at, std::size_t bytes) {
    const auto next = reinterpret_cast<std::uintptr_t>(at) + prefetched;
    for (std::size_t i = 0; i < bytes; i += 64) {
        __builtin_prefetch(reinterpret_cast<const void *>(next + i));
    }
}

// Red in the lowest byte of a word.
PARADIZE_STEP void read_colors(const Texels &from, std::size_t row, std::size_t column, std::int32_t *out) {
    const std::uint8_t *at = texel_at(from, row, column);
    const std::size_t here = from.columns - column < span ? from.columns - column : span;
    if (from.texel_stride == 4 && from.channels == 4) {
        std::memcpy(out, at, 4 * here);
        std::fill(out + here, out + span, out[here - 1]);
        return;
    }
    for (std::size_t i = 0; i < span; ++i) {
        const std::uint8_t *texel =
            at + static_cast<std::ptrdiff_t>(i < here ? i : here - 1) * from.texel_stride;
        const std::uint32_t alpha = from.channels == 4 ? texel[3] : 255U;
        out[i] = static_cast<std::int32_t>(texel[0] | static_cast<std::uint32_t>(texel[1]) << 8 |
                                           static_cast<std::uint32_t>(texel[2]) << 16 | alpha << 24);
    }
}

template <bool Grouped, typename Vector>
PARADIZE_INLINE void every_fourth_of(const Vector (&in)[4], Vector (&out)[4]) {
    if constexpr (Grouped) {
        every_fourth_grouped(in, out);
    } else {
        every_fourth(in, out);
    }
}

// Words of the texels of `lanes` blocks from block column `column` / 4 of block row `row` / 4. Grouped: in
// the order that `in_order` mends.
template <bool Grouped>
PARADIZE_INLINE void load_words(const Texels &from, std::size_t row, std::size_t column,
                                IntLanes (&words)[texels]) {
    const bool straight = from.texel_stride == 4 && from.channels == 4 && from.columns - column >= span;
    for (std::size_t y = 0; y < 4; ++y) {
        IntLanes line[4];
        if (straight) {
            const std::uint8_t *at = texel_at(from, row + y, column);
            fetch_ahead(at, sizeof(line));
            std::memcpy(line, at, sizeof(line));
        } else {
            std::int32_t some[span];
            read_colors(from, row + y, column, some);
            std::memcpy(line, some, sizeof(line));
        }
        IntLanes four[4];
        every_fourth_of<Grouped>(line, four);
        for (std::size_t x = 0; x < 4; ++x) {
            words[4 * y + x] = four[x];
        }
    }
}

PARADIZE_STEP void load_colors(const Texels &from, std::size_t row, std::size_t column,
                               IntLanes (&words)[texels]) {
    load_words<false>(from, row, column, words);
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
        if (from.texel_stride >= size && from.texel_stride <= 4 * size) {
            fetch_ahead(at, span * static_cast<std::size_t>(from.texel_stride));
        }
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

// Whether the texels lie as `load_bytes` takes them.
template <std::size_t Channels>
PARADIZE_INLINE bool straight_bytes(const Texels &from, std::size_t column) {
    return from.kind == Texels::Kind::unorm8 && from.columns - column >= span &&
           (from.texel_stride == 4 || (from.texel_stride == 1 && Channels == 1));
}

// Codes of bytes that lie four to a texel, or one.
template <std::size_t Channels, bool Grouped>
PARADIZE_STEP void load_bytes(const Texels &from, std::size_t row, std::size_t column, ValueBlocks *blocks) {
    for (std::size_t y = 0; y < 4; ++y) {
        const std::uint8_t *at = texel_at(from, row + y, column);
        fetch_ahead(at + 4 * from.row_stride - prefetched, 1);
        if (from.texel_stride == 1) { // a block's four are a word
            IntLanes word;
            std::memcpy(&word, at, sizeof(word));
            for (std::size_t x = 0; x < 4; ++x) {
                blocks[0].v[4 * y + x] = to_float(word >> (8 * static_cast<int>(x)) & 255);
            }
            continue;
        }
        IntLanes line[4], four[4];
        std::memcpy(line, at, sizeof(line));
        every_fourth_of<Grouped>(line, four);
        for (std::size_t x = 0; x < 4; ++x) {
            for (std::size_t c = 0; c < Channels; ++c) {
                blocks[c].v[4 * y + x] = to_float(four[x] >> (8 * static_cast<int>(c)) & 255);
            }
        }
    }
}

// Codes of the texels of `lanes` blocks; top: 255, or 127 for SNORM. Grouped: in the order that `in_order`
// mends, which is for two channels.
template <std::size_t Channels, bool Grouped = false>
PARADIZE_STEP void load_values(const Texels &from, std::size_t row, std::size_t column, float bottom,
                               float top, ValueBlocks *blocks) {
    if (straight_bytes<Channels>(from, column)) {
        return load_bytes<Channels, Grouped>(from, row, column, blocks);
    }
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
            every_fourth_of<Grouped>(line, four);
            for (std::size_t x = 0; x < 4; ++x) {
                blocks[c].v[4 * y + x] = four[x];
            }
        }
    }
}

} // namespace paradize::bcn::PARADIZE_WIDTH
