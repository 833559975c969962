// Colour to linear light and back, and to one luminance per texel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace paradize::maps {

// Encoded sRGB -> linear light, colour channels only (alpha, the last of 2 or 4 channels, is copied).
//   in, out: rows * columns * channels floats; may be the same memory
//   source_bits: 8 or 16 where every value is an integer over 255 or 65535 (a table is exact then); 32 else
void srgb_to_linear(std::span<const float> in, std::size_t channels, int source_bits, std::span<float> out,
                    int threads);

// Linear light -> 8-bit sRGB, each rounded to the nearest code in the encoded scale; alpha (the last of 2 or
// 4 channels) is rounded as it is. Values are clamped to [0, 1].
void linear_to_srgb8(std::span<const float> in, std::size_t channels, std::span<std::uint8_t> out,
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
