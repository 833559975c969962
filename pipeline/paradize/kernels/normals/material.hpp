// A colour picture -> height, normal, gloss and du/dv in one sweep down the rows, each of which is worked on
// while it is in a near cache; a second sweep finishes du/dv, whose mean is known only then.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "maps/color.hpp"
#include "normals/types.hpp"

namespace paradize::normals {

struct MaterialSettings {
    Settings normal;
    maps::Levels height; // luminance -> height
    maps::Levels gloss;  // luminance -> t
    float specular_low;  // specular intensity is low + t * step
    float specular_step;
    float smoothness_low; // smoothness is low + t * step
    float smoothness_step;
    bool encoded; // the colour is sRGB; else linear light
};

// Rows of colour, 3 or 4 channels; alpha is ignored. One of the pointers is not null: codes are shares of
// their largest.
struct ColorView {
    const std::uint8_t *bytes;
    const std::uint16_t *words;
    const float *floats;
    std::size_t rows;
    std::size_t columns;
    std::size_t channels;
};

struct MaterialOut {
    std::span<std::uint16_t> height; // rows * columns: 65535 h
    std::span<std::uint8_t> normal;  // * 3: as Encoding::rgb8
    std::span<std::uint8_t> gloss;   // * 2: 255 times specular intensity and smoothness
    std::span<std::int8_t> dudv;     // * 2: 127 (x - mean), 127 (y - mean); each sums to exactly zero
};

// The luminance of the colour's linear light makes the heights (0..1) and the gloss. The normals are those of
// normals_from_heights, of the heights before they become codes. A du/dv code is within 5/8 of 127 (x - c),
// where c, the same for all texels, makes the sum zero; where that leaves -127..127 they are cut off and c is
// larger. Throws NotFinite for a luminance that is not finite.
void material_maps(const ColorView &color, const MaterialSettings &settings, const MaterialOut &out,
                   int threads, Width width = Width::widest);

} // namespace paradize::normals
