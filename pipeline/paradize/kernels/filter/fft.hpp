// Discrete Fourier transforms of powers of two, `lanes` complex signals side by side, in float64.
//
// Source: T. G. Stockham, "High-speed convolution and correlation", 1966 (the order without bit reversal).
// Twiddles come from math/functions.hpp; every lane is computed alike, so the bits depend on neither the
// vector width nor the number of threads.
#pragma once

#include <cstddef>
#include <vector>

namespace paradize::filter {

inline constexpr std::size_t lanes = 8;
inline constexpr std::size_t element = 2 * lanes; // doubles of one sample: all real parts, then all imaginary

class Fft {
  public:
    // n samples, a power of two.
    explicit Fft(std::size_t n);

    // data: n * element doubles, replaced by the transform sum_j x[j] e^(-2 pi i j k / n). scratch: as many.
    void forward(double *data, double *scratch) const;

  private:
    std::size_t n_;
    std::vector<double> turns_; // cos, sin of -2 pi j / n for j of 0 .. n - 1
};

} // namespace paradize::filter
