// Unit normals of a height field in float64, row by row. For metrics only: shares nothing with the stages'
// kernels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "reference_maps_chain.hpp"
#include "reference_maps_fourier.hpp"

namespace paradize::reference {

struct Ground {
    std::span<const float> heights; // rows * columns, finite
    Size size;
    // A slope is the sum over k of derivative[k - 1] * (h[+k] - h[-k]) along its axis, smoothed across it by
    // smooth[0] at the texel and smooth[j] at +-j.
    std::vector<double> derivative;
    std::vector<double> smooth;
    bool spectral = false; // instead: the exact slope of the band-limited periodic interpolant
    double scale_x = 1.0;  // slope of one unit of height from one texel to the next
    double scale_y = 1.0;
    bool wrap_x = false; // where it does not repeat, heights are reflected oddly about the edge texel
    bool wrap_y = false;
    bool green_down = false;
    std::span<const std::int32_t> islands; // empty, or an id per texel, negative outside
};

// Planes x, y and z of unit normals; and, where there are islands, a fourth: 1 where the texel is on an
// island together with all that its taps touch, else 0.
class GroundRows final : public Rows {
  public:
    // threads: of the transforms, where the filter is the spectral one.
    GroundRows(const Ground &ground, int threads);
    std::size_t channels() const override { return ground_.islands.empty() ? 3 : 4; }
    void row(std::size_t y, double *out) override;
    std::unique_ptr<Rows> fresh() const override;

  private:
    const double *padded(std::ptrdiff_t y);
    void filtered(std::ptrdiff_t y);
    void inside(std::size_t y, double *out) const;

    Ground ground_;
    std::size_t reach_;
    std::vector<std::vector<double>> lines_; // rows y - reach .. y + reach, `reach` columns more on each side
    std::vector<std::ptrdiff_t> held_;
    std::vector<double> work_;
    std::vector<double> dx_;
    std::vector<double> dy_;
    std::shared_ptr<const Slopes> slopes_; // where the filter is the spectral one
};

} // namespace paradize::reference
