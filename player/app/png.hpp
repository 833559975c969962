#pragma once
// Writes PNG files.

#include <cstdint>
#include <filesystem>
#include <span>

namespace paradize {

/// Writes 8-bit sRGB pixels, first row at the top. `pixels` holds width * height * 3 bytes. Writes a hidden
/// temporary file and renames it, so that no partial file appears. Throws Error.
void write_png(const std::filesystem::path &path, std::span<const std::uint8_t> pixels, int width_px,
               int height_px);

} // namespace paradize
