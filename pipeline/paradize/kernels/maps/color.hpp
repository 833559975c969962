// Colour to linear light and back, and to one luminance per texel.
//
// Texels have 1 to 4 channels; alpha is the last of 2 or 4 and no colour transform touches it. `encoded` says
// that colour channels are sRGB (IEC 61966-2-1), else they are linear already.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace paradize::maps {

// File codes (uint8, uint16: shares of their largest) or floats -> linear light.
//   in, out: n * channels
template <typename T>
void linear_light(std::span<const T> in, std::size_t channels, bool encoded, std::span<float> out,
                  int threads);

// The same and halved at once: rows and columns are even. out: rows / 2 * columns / 2 * channels means of
// 2 x 2 texels, colour weighted by alpha where there is alpha (by area alone where all of it is transparent).
void halved_light(std::span<const std::uint8_t> in, std::size_t rows, std::size_t columns,
                  std::size_t channels, std::span<float> out, int threads);

// Any texels -> red, green, blue, alpha as 8-bit sRGB codes, each the nearest in the encoded scale. Grey
// becomes three channels; what has no alpha is opaque; values are clamped to [0, 1].
//   in: n * channels. out: n * 4
template <typename T>
void rgba_codes(std::span<const T> in, std::size_t channels, bool encoded, std::span<std::uint8_t> out,
                int threads);

// Rec. 709 luminance of linear colour: out[i] = 0.2126 r + 0.7152 g + 0.0722 b; grey is copied. Alpha is
// ignored.
void luminance(std::span<const float> in, std::size_t channels, std::span<float> out, int threads);

// How a luminance becomes a height or a gloss; the order is that of the fields.
struct Levels {
    double black = 0.0;      // luminance that maps to 0
    double white = 1.0;      // luminance that maps to 1; != black
    double gamma = 1.0;      // > 0: t^(1 / gamma), above 1 lifts the middle
    double contrast = 1.0;   // about one half
    double brightness = 0.0; // added
    bool invert = false;
};

// out[i] = levels of in[i], clamped to [0, 1] after the black and white points and at the end.
void apply_levels(std::span<const float> in, const Levels &levels, std::span<float> out, int threads);

} // namespace paradize::maps
