#include "reference/maps/texels.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

namespace paradize::reference {
namespace {

constexpr std::size_t nothing = std::numeric_limits<std::size_t>::max();

using Values = std::array<float, 16>;

std::size_t block_channels(Texels format) {
    switch (format) {
    case Texels::bc1:
        return 3;
    case Texels::bc3:
        return 4;
    case Texels::bc4:
        return 1;
    default:
        return 2;
    }
}

std::size_t block_bytes(Texels format) {
    return format == Texels::bc1 || format == Texels::bc4 ? 8 : 16;
}

std::size_t plain_bytes(Texels format) {
    switch (format) {
    case Texels::unorm8:
    case Texels::snorm8:
        return 1;
    case Texels::unorm16:
    case Texels::snorm16:
        return 2;
    default:
        return 4;
    }
}

bool of_blocks(Texels format) {
    return format >= Texels::bc1;
}

std::uint64_t little(const std::uint8_t *bytes, std::size_t count) {
    std::uint64_t word = 0;
    for (std::size_t i = 0; i < count; ++i) {
        word |= static_cast<std::uint64_t>(bytes[i]) << (8 * i);
    }
    return word;
}

// A block of 16 single values: two ends, and six between them or four and both extremes.
void decode_values(const std::uint8_t *block, bool is_signed, Values &out) {
    std::array<double, 8> palette{};
    int a = block[0];
    int b = block[1];
    if (is_signed) {
        a = static_cast<std::int8_t>(block[0]);
        b = static_cast<std::int8_t>(block[1]);
    }
    const double top = is_signed ? 127.0 : 255.0;
    const double low = is_signed ? -127.0 : 0.0;
    const double first = std::max<double>(a, low);
    const double second = std::max<double>(b, low);
    const int between = a > b ? 7 : 5;
    palette[0] = first / top;
    palette[1] = second / top;
    for (int k = 1; k < between; ++k) {
        palette[static_cast<std::size_t>(k) + 1] = ((between - k) * first + k * second) / (between * top);
    }
    if (between == 5) {
        palette[6] = low / top;
        palette[7] = 1.0;
    }
    std::uint64_t codes = little(block + 2, 6);
    for (float &value : out) {
        value = static_cast<float>(palette[codes & 7]);
        codes >>= 3;
    }
}

// A block of 16 colours: two ends of 5 6 5 bits, and two between them, or one and black.
void decode_colors(const std::uint8_t *block, bool always_four, std::array<Values, 3> &out) {
    const auto a = static_cast<unsigned>(little(block, 2));
    const auto b = static_cast<unsigned>(little(block + 2, 2));
    const auto codes = static_cast<std::uint32_t>(little(block + 4, 4));
    constexpr std::array<unsigned, 3> shift = {11, 5, 0};
    constexpr std::array<unsigned, 3> top = {31, 63, 31};
    for (std::size_t c = 0; c < 3; ++c) {
        const double first = (a >> shift[c]) & top[c];
        const double second = (b >> shift[c]) & top[c];
        const double full = top[c];
        std::array<float, 4> palette = {static_cast<float>(first / full), static_cast<float>(second / full),
                                        static_cast<float>((2 * first + second) / (3 * full)),
                                        static_cast<float>((first + 2 * second) / (3 * full))};
        if (!always_four && a <= b) {
            palette[2] = static_cast<float>((first + second) / (2 * full));
            palette[3] = 0.0F;
        }
        for (std::size_t i = 0; i < 16; ++i) {
            out[c][i] = palette[(codes >> (2 * i)) & 3];
        }
    }
}

float plain_value(Texels format, const std::uint8_t *bytes) {
    switch (format) {
    case Texels::unorm8:
        return static_cast<float>(bytes[0] / 255.0);
    case Texels::snorm8:
        return static_cast<float>(std::max(static_cast<std::int8_t>(bytes[0]) / 127.0, -1.0));
    case Texels::unorm16:
        return static_cast<float>(static_cast<double>(little(bytes, 2)) / 65535.0);
    case Texels::snorm16:
        return static_cast<float>(std::max(
            static_cast<std::int16_t>(static_cast<std::uint16_t>(little(bytes, 2))) / 32767.0, -1.0));
    default:
        return std::bit_cast<float>(static_cast<std::uint32_t>(little(bytes, 4)));
    }
}

} // namespace

std::size_t level_bytes(Texels format, std::size_t channels, Size size) {
    if (of_blocks(format)) {
        return (size.rows + 3) / 4 * ((size.columns + 3) / 4) * block_bytes(format);
    }
    return size.rows * size.columns * channels * plain_bytes(format);
}

TexelRows::TexelRows(Texels format, std::size_t channels, Size size, std::span<const std::uint8_t> data)
    : format_(format), channels_(of_blocks(format) ? block_channels(format) : channels), size_(size),
      data_(data), depth_(of_blocks(format) ? 4 : 1), stride_((size.columns + 3) / 4 * 4), first_(nothing),
      values_(channels_ * depth_ * stride_) {}

const float *TexelRows::row(std::size_t y, std::size_t c) {
    const std::size_t first = y / depth_ * depth_;
    if (first != first_) {
        if (of_blocks(format_)) {
            decode_blocks(first);
        } else {
            decode_plain(first);
        }
        first_ = first;
    }
    return &values_[(c * depth_ + (y - first)) * stride_];
}

void TexelRows::decode_plain(std::size_t y) {
    const std::size_t bytes = plain_bytes(format_);
    const std::uint8_t *from = &data_[y * size_.columns * channels_ * bytes];
    for (std::size_t c = 0; c < channels_; ++c) {
        float *to = &values_[c * stride_];
        for (std::size_t x = 0; x < size_.columns; ++x) {
            to[x] = plain_value(format_, from + (x * channels_ + c) * bytes);
        }
    }
}

void TexelRows::decode_blocks(std::size_t y) {
    const std::size_t across = stride_ / 4;
    const std::size_t bytes = block_bytes(format_);
    std::array<Values, 4> texels{};
    std::array<Values, 3> colors{};
    for (std::size_t i = 0; i < across; ++i) {
        const std::uint8_t *block = &data_[(y / 4 * across + i) * bytes];
        switch (format_) {
        case Texels::bc1:
        case Texels::bc3:
            decode_colors(block + (format_ == Texels::bc3 ? 8 : 0), format_ == Texels::bc3, colors);
            std::copy(colors.begin(), colors.end(), texels.begin());
            if (format_ == Texels::bc3) {
                decode_values(block, false, texels[3]);
            }
            break;
        default:
            for (std::size_t c = 0; c < channels_; ++c) {
                decode_values(block + 8 * c, format_ == Texels::bc5_signed, texels[c]);
            }
        }
        for (std::size_t c = 0; c < channels_; ++c) {
            for (std::size_t row = 0; row < 4; ++row) {
                std::memcpy(&values_[(c * 4 + row) * stride_ + 4 * i], &texels[c][4 * row],
                            4 * sizeof(float));
            }
        }
    }
}

} // namespace paradize::reference
