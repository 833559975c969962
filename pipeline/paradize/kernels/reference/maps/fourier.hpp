// Slopes of periodic lines by their spectrum. For metrics only: shares nothing with the stages' transform.
#pragma once

#include <complex>
#include <cstddef>
#include <span>
#include <vector>

namespace paradize::reference {

// Transforms of one length, any from 1: by halves where it is a power of two, else as a convolution.
// Sources: J. Cooley and J. Tukey, "An algorithm for the machine calculation of complex Fourier series",
// 1965; L. Bluestein, "A linear filtering approach to the computation of discrete Fourier transform", 1970.
class Fourier {
  public:
    explicit Fourier(std::size_t length);

    // Replaces two lines by the slope, per texel, of the trigonometric polynomial of least degree through
    // them. The highest frequency of an even length has no slope at its own texels.
    void slopes(std::span<double> a, std::span<double> b);

  private:
    using Complex = std::complex<double>;
    void forward(std::vector<Complex> &line);
    void powers(std::vector<Complex> &line) const;

    std::size_t length_;
    std::size_t inner_;                // a power of two, at least length_
    std::vector<Complex> roots_;       // e^(-2 pi i k / inner_), k < inner_ / 2
    std::vector<Complex> chirp_;       // e^(-pi i k^2 / length_), where the length is no power of two
    std::vector<Complex> chirp_terms_; // the transform of the chirp that lines are convolved with
    std::vector<Complex> line_;
    std::vector<Complex> wide_;
};

// Slopes along x and along y of periodic heights (rows, columns), each a plane of float32.
struct Slopes {
    std::vector<float> x;
    std::vector<float> y;
};
Slopes spectral_slopes(std::span<const float> heights, std::size_t rows, std::size_t columns, int threads);

} // namespace paradize::reference
