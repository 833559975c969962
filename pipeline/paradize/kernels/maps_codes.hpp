// Signed 8-bit codes of unit vectors and of du/dv.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace paradize::maps {

// in: n values of each of `channels` channels, interleaved, within [-1, 1]. out: SNORM codes v * 127,
// nearest.
void snorm8(std::span<const float> in, std::span<std::int8_t> out, int threads);

// normals: n * 3. out: n * 2, x and y less their mean over the map: the mean of a whole tile is zero.
void centred_xy(std::span<const float> normals, std::span<float> out);

// in: n * 2 floats. out: n * 2 SNORM codes whose sum over all texels is exactly zero in each channel. The
// codes that rounding moved furthest are moved back by one until the sum is zero; none changes by more than
// one.
void balanced_snorm8(std::span<const float> in, std::span<std::int8_t> out);

} // namespace paradize::maps
