// Signed 8-bit codes of unit vectors and of du/dv.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace paradize::maps {

// in: n values within [-1, 1]. out: SNORM codes v * 127, nearest.
void snorm8(std::span<const float> in, std::span<std::int8_t> out, int threads);

// Du/dv codes: vectors, n * 3, whose x and y less `mean` (two numbers) become SNORM codes, n * 2. rest: what
// rounding left, value * 127 - code in steps of 1/64, cut off at +-2 codes.
void dudv_codes(std::span<const float> vectors, std::span<const double> mean, std::span<std::int8_t> codes,
                std::span<std::int8_t> rest, int threads);

// Moves codes (n * 2) by one until their sum is exactly zero in each channel: those that rounding moved
// furthest the other way go first, equal ones in order. rest: as dudv_codes gives it; changed along. One
// round is enough, and no code moves by more than one, unless values were cut off at the end of the range.
void balance(std::span<std::int8_t> codes, std::span<std::int8_t> rest);

} // namespace paradize::maps
