// How wrong each derivative filter would be on a map: its truncation at the map's wavelengths and the noise
// that it lets through, predicted from a few hundred thousand texels at most.
//
// Patches of the map, less their best quadratic (on which no filter here errs), give a spectrum P; the steps
// of their values give the noise N. A filter whose answer is i H(k) where i k is right errs by (P - N) |H -
// k|^2 + N |H|^2, summed over the spectrum (C. Stein, "Estimation of the mean of a multivariate normal
// distribution", 1981; P - N counts only where it stands out of the noise). Rounded to steps, a surface that
// rises by g steps per texel carries a sawtooth of the frequencies m g, aliased: where it is gentle the noise
// is not white (W. R. Bennett, "Spectra of quantized signals", 1948).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace paradize::filter {

inline constexpr std::size_t reach = 16; // the longest filter

struct Map {
    std::span<const float> heights; // rows * columns, finite
    std::size_t rows;
    std::size_t columns;
    std::span<const std::int32_t> islands; // empty, or an id per texel: no patch lies on two islands
    int source_bits; // 8 and 16: an integer over 255 or 65535 at the finest; 32: a float
    bool wrap_x;
    bool wrap_y;
    std::span<const float> codes = {}; // rising: the heights of the source's codes as greys; empty: not known
};

struct Prediction {
    std::vector<double> errors; // mean square error of the slope in units of height per texel, per filter
    double step;                // the step of the heights as found, 0 where they have none
};

// derivative: `reach` weights of h[+k] - h[-k] per filter, k from 1; smooth: reach + 1 weights of the centre
// and of +-k. Maps too small to have a spectrum give errors of zero.
Prediction predict_errors(const Map &map, std::span<const double> derivative, std::span<const double> smooth);

} // namespace paradize::filter
