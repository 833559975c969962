// Unit normals of a height field in float64, row by row. For metrics only: shares nothing with the stages'
// kernels.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "reference/maps/chain.hpp"

namespace paradize::reference {

// A slope is the sum over k of derivative[k - 1] * (h[+k] - h[-k]) along its axis, smoothed across it by
// smooth[0] at the texel and smooth[j] at +-j.
struct Taps {
    std::vector<double> derivative;
    std::vector<double> smooth;
    std::size_t reach() const { return std::max(derivative.size(), smooth.size() - 1); }
};

struct HeightMap {
    std::span<const float> heights; // rows * columns, finite
    Size size;
    Taps taps;
    double scale_x = 1.0; // slope of one unit of height from one texel to the next
    double scale_y = 1.0;
    bool wrap_x = false; // where it does not repeat, heights are reflected oddly about the edge texel
    bool wrap_y = false;
    bool green_down = false;
    std::span<const std::int32_t> islands; // empty, or an id per texel, negative outside
    // Rising: the heights that neighbouring codes of the source stand for; empty where it holds floats. A
    // height is known to half of the gap between the codes beside it, and no better.
    std::span<const float> codes;
    Taps exact;         // of the slopes that those half steps surround
    bool held = false;  // the taps' slopes are held to what the half steps allow
    bool cones = false; // a plane of the angle that they leave open
    // Empty, or x, y, z of rows * columns unit vectors or means of such: the normals of a map that somebody
    // drew. Then heights, taps and codes are empty, and cones are false.
    std::span<const float> drawn;
};

class HalfSteps;

// Planes x, y and z of unit normals. Then, where there are islands, one that is 1 where the texel is on an
// island together with all that its taps touch, else 0. Then, with cones, one of degrees: between the normal
// and the farthest whose slopes along x and y lie within the reach of the half steps (0 without codes).
class NormalRows final : public Rows {
  public:
    explicit NormalRows(const HeightMap &height_map);
    std::size_t channels() const override { return cone_plane() + (height_map_.cones ? 1 : 0); }
    std::size_t cone_plane() const { return height_map_.islands.empty() ? 3 : 4; }
    void row(std::size_t y, double *out) override;
    std::unique_ptr<Rows> fresh() const override;

  private:
    // Rows y - reach .. y + reach with `reach` columns more on each side.
    struct Window {
        std::vector<std::vector<double>> lines;
        std::vector<std::ptrdiff_t> held;
    };
    struct Steepness {
        std::vector<double> x;
        std::vector<double> y;
    };
    std::vector<double> *line(Window &window, std::ptrdiff_t y, bool &fresh) const;
    void pad(std::vector<double> &line, double sign) const;
    const double *padded(std::ptrdiff_t y);
    const double *half_steps(std::ptrdiff_t y);
    void filtered(std::ptrdiff_t y, const Taps &taps, Steepness &out);
    void reached(std::ptrdiff_t y);
    void hold();
    void cone(double *normals, double *degrees);
    void drawn(std::size_t y, double *out) const;
    void inside(std::size_t y, double *out) const;
    double signed_scale_y() const {
        return height_map_.green_down ? -height_map_.scale_y : height_map_.scale_y;
    }

    HeightMap height_map_;
    std::size_t reach_;
    Window heights_;
    Window halves_;
    std::vector<double> work_;
    Steepness slope_;
    Steepness exact_;
    Steepness open_; // how far the half steps let a slope be off
    Steepness corner_;
    std::vector<double> corner_z_;
    std::shared_ptr<const HalfSteps> half_steps_; // where there are codes
};

} // namespace paradize::reference
