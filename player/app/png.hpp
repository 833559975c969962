#pragma once
// PNG files of finished pictures.

#include <cstdint>
#include <filesystem>
#include <span>

namespace paradize {

/// Writes 8-bit sRGB, rows from the top, whole or not at all (a hidden file beside it is renamed). `pixels`
/// holds width * height * 3 bytes. Throws Error.
void write_png(const std::filesystem::path &path, std::span<const std::uint8_t> pixels, int width_px,
               int height_px);

} // namespace paradize
