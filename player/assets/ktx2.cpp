#include "assets/ktx2.hpp"

#include "assets/inflate.hpp"
#include "error.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

namespace paradize::assets {

namespace {

constexpr std::array<unsigned char, 12> identifier{0xAB, 'K',  'T',  'X',  ' ',  '2',
                                                   '0',  0xBB, '\r', '\n', 0x1A, '\n'};
constexpr std::size_t level_entry_bytes = 24;
constexpr std::size_t max_level_count = std::bit_width(max_texture_px);
constexpr std::uint32_t zstandard = 2;

static_assert(std::endian::native == std::endian::little,
              "KTX2 and glTF are read in place: little-endian only");

template <typename T>
T read_at(std::span<const std::byte> bytes, std::size_t offset) {
    T value;
    std::memcpy(&value, bytes.data() + offset, sizeof value);
    return value;
}

/// True if [offset, offset + length) lies inside `size` bytes. Does not overflow.
bool inside(std::uint64_t offset, std::uint64_t length, std::uint64_t size) {
    return offset <= size && length <= size - offset;
}

} // namespace

bool has_green(PixelFormat format) {
    constexpr std::array red_only{PixelFormat::r8_unorm, PixelFormat::r16_unorm, PixelFormat::r32_float,
                                  PixelFormat::bc4_unorm};
    return std::ranges::find(red_only, format) == red_only.end();
}

BlockShape block_shape(PixelFormat format) {
    switch (format) {
    case PixelFormat::r8_unorm:
        return {1, 1};
    case PixelFormat::rg8_unorm:
    case PixelFormat::rg8_snorm:
    case PixelFormat::r16_unorm:
        return {2, 1};
    case PixelFormat::rgba8_unorm:
    case PixelFormat::rgba8_srgb:
    case PixelFormat::rg16_unorm:
    case PixelFormat::rg16_snorm:
    case PixelFormat::r32_float:
        return {4, 1};
    case PixelFormat::rgba16_float:
        return {8, 1};
    case PixelFormat::bc1_rgb_unorm:
    case PixelFormat::bc1_rgb_srgb:
    case PixelFormat::bc4_unorm:
        return {8, 4};
    case PixelFormat::bc3_unorm:
    case PixelFormat::bc3_srgb:
    case PixelFormat::bc5_unorm:
    case PixelFormat::bc5_snorm:
    case PixelFormat::bc7_unorm:
    case PixelFormat::bc7_srgb:
        return {16, 4};
    }
    return {0, 1};
}

std::size_t ktx2_front_bytes(std::span<const std::byte> header) {
    const std::size_t levels = header.size() < ktx2_header_bytes ? 0 : read_at<std::uint32_t>(header, 40);
    return ktx2_header_bytes + std::min(levels, max_level_count) * level_entry_bytes;
}

void check_frames(const Ktx2 &ktx, const std::string &name) {
    for (std::size_t i = 0; i < ktx.levels.size(); ++i) {
        const Ktx2Level &level = ktx.levels[i];
        if (level.compressed.empty()) {
            continue;
        }
        if (const std::string error = frame_error(level.compressed, level.bytes.size()); !error.empty()) {
            throw Error(name + ": level " + std::to_string(i) + ": " + error + bake_again);
        }
    }
}

Ktx2 read_ktx2_front(std::span<const std::byte> file, const std::string &name) {
    const auto refuse = [&](const std::string &what) { throw Error(name + ": " + what); };
    if (file.size() < ktx2_header_bytes ||
        std::memcmp(file.data(), identifier.data(), identifier.size()) != 0) {
        refuse("is not a KTX2 file (" + std::to_string(file.size()) +
               " bytes, wrong or truncated identifier)");
    }
    const auto field = [&](std::size_t offset) { return read_at<std::uint32_t>(file, offset); };
    Ktx2 out;
    out.format = static_cast<PixelFormat>(field(12));
    const std::uint32_t width = field(20);
    const std::uint32_t height = field(24);
    const std::uint32_t depth = field(28);
    const std::uint32_t layers = field(32);
    out.faces = field(36);
    const std::uint32_t levels = field(40);
    const std::uint32_t supercompression = field(44);
    const BlockShape block = block_shape(out.format);
    if (block.bytes == 0) {
        refuse("header: vkFormat " + std::to_string(field(12)) +
               " is not among the formats that the player samples");
    }
    if (width == 0 || height == 0 || width > max_texture_px || height > max_texture_px) {
        refuse("header: " + std::to_string(width) + " x " + std::to_string(height) +
               " texels, must lie in 1 to " + std::to_string(max_texture_px));
    }
    if (depth != 0 || layers != 0) {
        refuse("header: depth " + std::to_string(depth) + " and layers " + std::to_string(layers) +
               " must be 0");
    }
    if ((out.faces != 1 && out.faces != 6) || (out.faces == 6 && width != height)) {
        refuse("header: " + std::to_string(out.faces) + " faces of " + std::to_string(width) + " x " +
               std::to_string(height) + ", must be 1, or 6 square ones");
    }
    const std::uint32_t max_levels = static_cast<std::uint32_t>(std::bit_width(std::max(width, height)));
    if (levels == 0 || levels > max_levels) {
        refuse("header: " + std::to_string(levels) + " levels, must lie in 1 to " +
               std::to_string(max_levels));
    }
    if (supercompression != 0 && supercompression != zstandard) {
        refuse("header: supercompression " + std::to_string(supercompression) +
               ", must be 0 (none) or 2 (Zstandard)");
    }
    if (!inside(ktx2_header_bytes, std::uint64_t{levels} * level_entry_bytes, file.size())) {
        refuse("level index: ends at byte " + std::to_string(ktx2_header_bytes + levels * level_entry_bytes) +
               ", the file has " + std::to_string(file.size()) + " bytes");
    }
    std::uint64_t total = 0;
    for (std::uint32_t i = 0; i < levels; ++i) {
        const std::size_t entry = ktx2_header_bytes + i * level_entry_bytes;
        const auto offset = read_at<std::uint64_t>(file, entry);
        const auto length = read_at<std::uint64_t>(file, entry + 8);
        Ktx2Level level;
        level.format = out.format;
        level.faces = out.faces;
        level.width_px = std::max(1U, width >> i);
        level.height_px = std::max(1U, height >> i);
        const std::uint64_t across = (level.width_px + block.edge_px - 1) / block.edge_px;
        const std::uint64_t down = (level.height_px + block.edge_px - 1) / block.edge_px;
        const std::uint64_t expected = across * down * block.bytes * out.faces;
        const bool compressed = supercompression == zstandard;
        const std::string place = "level " + std::to_string(i) + ": ";
        if (length != expected && !compressed) {
            refuse(place + "the level index says " + std::to_string(length) + " bytes, " +
                   std::to_string(level.width_px) + " x " + std::to_string(level.height_px) +
                   " texels take " + std::to_string(expected));
        }
        if (!inside(offset, length, file.size())) {
            refuse(place + std::to_string(length) + " bytes from byte " + std::to_string(offset) +
                   " on exceed a file of " + std::to_string(file.size()));
        }
        level.bytes = file.subspan(offset, length);
        if (compressed) {
            if (length == 0) {
                refuse(place + "has no Zstandard frame");
            }
            const auto inflated = read_at<std::uint64_t>(file, entry + 16);
            if (inflated != expected) {
                refuse(place + std::to_string(inflated) + " bytes uncompressed, expected " +
                       std::to_string(expected));
            }
            total += expected;
            if (total > max_inflated_bytes) {
                refuse(place + "decompresses to more than " + std::to_string(max_inflated_bytes) + " bytes");
            }
            level.compressed = level.bytes;
            level.inflated = out.inflated_memory.emplace_back(expected).bytes();
            level.bytes = level.inflated;
        }
        out.levels.push_back(level);
    }
    return out;
}

} // namespace paradize::assets
