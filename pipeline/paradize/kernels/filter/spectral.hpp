// Slopes of a map that repeats, exact for whatever its texels can hold.
#pragma once

#include <cstddef>
#include <span>

namespace paradize::filter {

// The derivative of the band-limited periodic surface through the texels, per texel, along the rows (dx) and
// along the columns (dy). What alternates from texel to texel has no slope there: at the Nyquist frequency of
// an even length the derivative is set to zero. A line of equal values has exactly zero slopes.
//   heights: rows * columns, finite; dx, dy: the same size. Scratch: some 40 lines in float64 per thread.
// Source: L. N. Trefethen, "Spectral Methods in MATLAB", 2000, chapter 3.
void spectral_slopes(std::span<const float> heights, std::size_t rows, std::size_t columns,
                     std::span<float> dx, std::span<float> dy, int threads);

} // namespace paradize::filter
