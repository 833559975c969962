// Luminance of byte colours by table.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace paradize::normals {

// What each code of red, green and blue adds to the luminance.
using Shares = std::array<std::array<float, 256>, 3>;

// The same, its floats cut into their four bytes: planes[c][b][code] is byte b, the lowest first.
struct SharePlanes {
    alignas(64) std::uint8_t planes[3][4][256];
};

SharePlanes planes_of(const Shares &shares);

// Whether this CPU looks up 64 bytes at once (AVX-512 VBMI).
bool has_byte_lookup();

// The luminance of n texels, 64 at a time, of 3 or 4 bytes: (red + green) + blue. Returns how many it did;
// the others are the caller's. Only where has_byte_lookup().
std::size_t light_of_bytes(const std::uint8_t *texels, std::size_t n, std::size_t channels,
                           const SharePlanes &shares, float *to);

} // namespace paradize::normals
