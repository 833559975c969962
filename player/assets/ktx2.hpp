#pragma once
// KTX2 textures as the bake writes them (Khronos KTX 2.0 specification; pipeline/paradize/formats/FORMAT.md).
// Zstandard-supercompressed levels are found and checked here; an Inflater unpacks them.

#include "assets/reserved_memory.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace paradize::assets {

/// Values are Vulkan's VkFormat.
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

/// Bytes and edge length of the block that a format stores; an uncompressed texel is a block of edge 1.
struct BlockShape {
    std::uint32_t bytes = 0;
    std::uint32_t edge_px = 1;
};
/// Bytes 0 for a format that is not in PixelFormat.
BlockShape block_shape(PixelFormat format);

struct Ktx2Level {
    std::span<const std::byte> bytes;      // all faces, one after the other; rows top first, not padded
    std::span<const std::byte> compressed; // the Zstandard frame that `bytes` is inflated from; empty: none
    std::span<std::byte> inflated; // with `packed`: where it is inflated to, the same place as `bytes`
    std::uint32_t width_px = 0;
    std::uint32_t height_px = 0;
    PixelFormat format = PixelFormat::rgba8_unorm; // of the texture
    std::uint32_t faces = 1;                       // of the texture
};

struct Ktx2 {
    PixelFormat format = PixelFormat::rgba8_unorm;
    std::uint32_t faces = 1;                     // 1, or 6: +X -X +Y -Y +Z -Z
    std::vector<Ktx2Level> levels;               // level 0, the finest, first
    std::vector<ReservedMemory> inflated_memory; // of supercompressed files: one a level
};

/// Edge of the largest texture that is taken.
inline constexpr std::uint32_t max_texture_px = 16384;
/// What a supercompressed file may inflate to.
inline constexpr std::uint64_t max_inflated_bytes = std::uint64_t{1} << 31U;

/// Spans point into `file`, or into rooms that are yet to be inflated into. Throws Error with the place, the
/// value and the limit.
Ktx2 read_ktx2(std::span<const std::byte> file, const std::string &name);

} // namespace paradize::assets
