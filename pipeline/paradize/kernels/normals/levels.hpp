// Rows of luminance and of levels.
#pragma once

#include <cstddef>
#include <vector>

#include "normals/light.hpp"
#include "normals/material.hpp"

namespace paradize::normals {

// Colour rows -> Rec. 709 luminance of their linear light, as maps::linear_light and maps::luminance.
class Luminance {
  public:
    // widest: whether wider lookups may be used where this CPU has them.
    Luminance(const ColorView &color, bool encoded, bool widest);

    // Row y as floats. Throws NotFinite.
    void row(std::size_t y, float *to) const;

    // Whether every luminance is within 0..1 and so coarse that neutral levels leave it as it is.
    bool exact_unit() const;

  private:
    ColorView color_;
    bool encoded_;
    bool lookup_;
    Shares shares_{}; // of bytes: of each channel, weight times linear light
    SharePlanes planes_{};
    std::vector<float> table_; // of words: linear light
};

// The levels of a row, as maps::apply_levels.
class LevelRow {
  public:
    LevelRow(const maps::Levels &levels, const Luminance &luminance, const Kernels &kernels);
    // Whether the levels leave every value as it is.
    bool neutral() const { return neutral_; }
    void apply(const float *from, std::size_t n, float *to) const;

  private:
    maps::Levels levels_;
    bool neutral_;
    const Kernels &kernels_;
};

} // namespace paradize::normals
