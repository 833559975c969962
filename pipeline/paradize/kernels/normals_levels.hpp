// Rows of luminance and of levels.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "normals_material.hpp"

namespace paradize::normals {

// Colour rows -> Rec. 709 luminance of their linear light, as maps::linear_light and maps::luminance.
class Luminance {
  public:
    Luminance(const ColorView &color, bool encoded);

    // Row y as floats. Throws NotFinite.
    void row(std::size_t y, float *to) const;

  private:
    ColorView color_;
    bool encoded_;
    std::array<std::array<float, 256>, 3> shares_{}; // of bytes: of each channel, weight times linear light
    std::vector<float> table_;                       // of words: linear light
};

// The levels of a row, as maps::apply_levels.
class LevelRow {
  public:
    // exact_unit: the values are those of bytes, so that neutral levels need no arithmetic.
    LevelRow(const maps::Levels &levels, bool exact_unit, const Kernels &kernels);
    void apply(const float *from, std::size_t n, float *to) const;

  private:
    maps::Levels levels_;
    bool neutral_;
    const Kernels &kernels_;
};

} // namespace paradize::normals
