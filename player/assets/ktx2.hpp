#pragma once
// Reads KTX2 textures as the bake writes them (Khronos KTX 2.0 specification;
// pipeline/paradize/formats/FORMAT.md). Zstandard-compressed levels are located and checked here; an Inflater
// decompresses them.

#include "assets/reserved_memory.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace paradize::assets {

/// The values are those of VkFormat.
enum class PixelFormat : std::uint32_t {
    r8_unorm = 9,
    rg8_unorm = 16,
    rg8_snorm = 17,
    rgba8_unorm = 37,
    rgba8_srgb = 43,
    r16_unorm = 70,
    rg16_unorm = 77,
    rg16_snorm = 78,
    rgba16_float = 97,
    r32_float = 100,
    bc1_rgb_unorm = 131,
    bc1_rgb_srgb = 132,
    bc3_unorm = 137,
    bc3_srgb = 138,
    bc4_unorm = 139,
    bc5_unorm = 141,
    bc5_snorm = 142,
    bc7_unorm = 145,
    bc7_srgb = 146,
};

/// Bytes and edge length of a format's blocks. For uncompressed formats a block is one texel.
struct BlockShape {
    std::uint32_t bytes = 0;
    std::uint32_t edge_px = 1;
};
/// `bytes` is 0 for a format that is not in PixelFormat.
BlockShape block_shape(PixelFormat format);

/// True if the format stores more than a red channel.
bool has_green(PixelFormat format);

struct Ktx2Level {
    std::span<const std::byte> bytes;      // all faces in order, rows from the top, without padding
    std::span<const std::byte> compressed; // Zstandard frame of `bytes`; empty: not compressed
    std::span<std::byte> inflated;         // if compressed: the memory of `bytes`, filled later
    std::uint32_t width_px = 0;
    std::uint32_t height_px = 0;
    PixelFormat format = PixelFormat::rgba8_unorm; // of the texture
    std::uint32_t faces = 1;                       // of the texture
};

struct Ktx2 {
    PixelFormat format = PixelFormat::rgba8_unorm;
    std::uint32_t faces = 1;                     // 1, or 6 in the order +X -X +Y -Y +Z -Z
    std::vector<Ktx2Level> levels;               // level 0, the finest, comes first
    std::vector<ReservedMemory> inflated_memory; // one per level of a supercompressed file
};

/// Limit of a texture's edge.
inline constexpr std::uint32_t max_texture_px = 16384;
/// Limit of a file's size after decompression.
inline constexpr std::uint64_t max_inflated_bytes = std::uint64_t{1} << 31U;

/// A file is read in two steps. The first needs only the first ktx2_front_bytes() bytes of the file, which
/// its header tells. Spans point into `file`, or into memory that is filled later. The second checks the
/// headers of the compressed levels. Both throw Error with place, value and limit.
inline constexpr std::size_t ktx2_header_bytes = 80;
std::size_t ktx2_front_bytes(std::span<const std::byte> header);
Ktx2 read_ktx2_front(std::span<const std::byte> file, const std::string &name);
void check_frames(const Ktx2 &ktx, const std::string &name);

} // namespace paradize::assets
