// Rows of normals one after the other, out of whatever gives heights.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "normals/lines.hpp"
#include "normals/types.hpp"

namespace paradize::normals {

// A height or a slope that is not finite was met; the caller looks for its place.
struct NotFinite {};

// Unit normals of slopes already times their scale, in double: right for any finite slope.
void steep_normals(const double *nx, const double *ny, std::size_t n, float *xyz);

// Goes down a map; rows are asked for in rising order. One per thread.
class Sweep {
  public:
    Sweep(Source &source, std::size_t rows, std::size_t columns, const Settings &settings,
          const Kernels &kernels);
    ~Sweep();

    // Unit normals of row y, with up to `slack` bytes more.
    void row(std::size_t y, float *xyz);

  private:
    class Steep;
    void prepare(std::ptrdiff_t y);
    void steep_row(std::size_t y, float *xyz);

    std::size_t rows_;
    std::size_t columns_;
    Settings settings_;
    const Kernels &kernels_;
    int depth_;
    bool general_;
    bool all_steep_;
    Source &source_;
    Lines<float> lines_;
    std::array<float, largest_reach> left_{};
    std::array<float, largest_reach> down_{};
    std::array<float, largest_reach + 1> smooth_{};
    std::vector<const float *> at_;
    std::vector<const float *> along_at_;
    std::vector<float> along_;
    std::vector<float> scratch_;
    std::unique_ptr<Steep> steep_;
};

// Whether float holds a weight with all its digits, or it is zero.
bool fits_float(double weight);

// Whether a row holds only finite values.
bool all_finite(const float *values, std::size_t n);

} // namespace paradize::normals
