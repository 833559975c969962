// Codes of one component of a unit vector, in whole numbers: exactly rounded, the same on every CPU.
#pragma once

#include <cstdint>
#include <limits>

namespace paradize::normals {

// v 2^30: exact for |v| >= 2^-7, cut off towards zero below that.
inline std::int32_t fixed_point(float v) {
    return static_cast<std::int32_t>(v * 0x1p30F);
}

// floor(127.5 v) + 128: the code whose 2c/255 - 1 is nearest; 128 for 0. (127.5 v = 128 v - v / 2.)
inline std::uint8_t unorm_code(float v) {
    const std::int32_t i = fixed_point(v);
    return static_cast<std::uint8_t>((i + ((-i) >> 8) + (1 << 30)) >> 23);
}

// 127 v, nearest, halves away from zero. (127 v = 128 v - v; -|v| 2^31 is exact where a border is.)
inline std::int8_t snorm_code(float v) {
    const auto n = v <= -1.0F || v >= 1.0F ? std::numeric_limits<std::int32_t>::min()
                                           : static_cast<std::int32_t>((v < 0.0F ? v : -v) * 0x1p31F);
    const std::int32_t code = ((n >> 7) - n + (1 << 23)) >> 24;
    return static_cast<std::int8_t>(v < 0.0F ? -code : code);
}

// 256 * 127 v, nearest: a snorm code with eight bits more. Its low byte beside unorm_code(v) is enough to
// have it back: fine = 255 d + ((low + d) & 255) with d = unorm_code(v) - 128.
inline std::int32_t fine_code(float v) {
    const std::int32_t i = fixed_point(v);
    return (i + ((-i) >> 7) + (1 << 14)) >> 15;
}

inline std::int32_t fine_code(std::uint8_t unorm, std::uint8_t low) {
    const std::int32_t d = static_cast<std::int32_t>(unorm) - 128;
    return 255 * d + ((low + d) & 255);
}

} // namespace paradize::normals
