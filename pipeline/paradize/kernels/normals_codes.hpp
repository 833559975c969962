// Codes of one component of a unit vector, in whole numbers: exactly rounded, the same on every CPU.
#pragma once

#include <cstdint>

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

// 127 v, nearest, halves away from zero. (127 v = 128 v - v.)
inline std::int8_t snorm_code(float v) {
    const std::int32_t i = fixed_point(v);
    const std::int32_t magnitude = i < 0 ? -i : i;
    const std::int32_t code = (magnitude + ((-magnitude) >> 7) + (1 << 22)) >> 23;
    return static_cast<std::int8_t>(i < 0 ? -code : code);
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
