// Discrete Fourier transforms of any length, `lanes` complex signals side by side, in float64.
//
// Sources: T. G. Stockham, "High-speed convolution and correlation", 1966 (the order without bit reversal);
// L. I. Bluestein, "A linear filtering approach to the computation of discrete Fourier transform", 1970
// (lengths with a large prime factor). Twiddles come from math/functions.hpp; every lane is computed alike,
// so the bits depend on neither the vector width nor the number of threads.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

namespace paradize::filter {

inline constexpr std::size_t lanes = 8;
inline constexpr std::size_t element = 2 * lanes; // doubles of one sample: all real parts, then all imaginary

class Fft {
  public:
    // n >= 1 samples.
    explicit Fft(std::size_t n);

    std::size_t size() const { return n_; }
    std::size_t scratch_size() const; // doubles that forward() wants beside the data

    // data: n * element doubles, replaced by the transform sum_j x[j] e^(-2 pi i j k / n). The inverse is
    // this with real and imaginary parts exchanged before and after, divided by n.
    void forward(double *data, double *scratch) const;

  private:
    void stockham(double *data, double *scratch) const;
    void bluestein(double *data, double *scratch) const;

    std::size_t n_;
    std::vector<std::size_t> factors_;
    std::vector<double> turns_;    // cos, sin of -2 pi j / n for j of 0 .. n - 1
    std::unique_ptr<Fft> longer_;  // Bluestein: a power of two, at least 2 n - 1
    std::vector<double> chirp_;    // Bluestein: e^(-pi i j^2 / n)
    std::vector<double> response_; // Bluestein: the transform of the conjugated chirp over its length
};

} // namespace paradize::filter
