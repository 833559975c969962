#include "reference/maps/fourier.hpp"

#include <algorithm>
#include <bit>

#include "math/functions.hpp"
#include "parallel.hpp"

namespace paradize::reference {
namespace {

using Complex = std::complex<double>;

constexpr std::size_t together = 16; // lines that are read at once, an even number

// e^(-2 pi i part / whole)
Complex root(std::size_t part, std::size_t whole) {
    const double angle = 2.0 * mathx::pi * (static_cast<double>(part) / static_cast<double>(whole));
    return {mathx::cos(angle), -mathx::sin(angle)};
}

Complex product(Complex a, Complex b) { // without the standard one's care for infinities
    return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}

} // namespace

Fourier::Fourier(std::size_t length)
    : length_(length), inner_(std::has_single_bit(length) ? length : std::bit_ceil(2 * length)),
      roots_(inner_ / 2), line_(length) {
    for (std::size_t k = 0; k < roots_.size(); ++k) {
        roots_[k] = root(k, inner_);
    }
    if (inner_ == length_) {
        return;
    }
    chirp_.resize(length_);
    wide_.assign(inner_, Complex());
    for (std::size_t k = 0; k < length_; ++k) {
        chirp_[k] = root(k * k % (2 * length_), 2 * length_);
        wide_[k] = std::conj(chirp_[k]);
        wide_[(inner_ - k) % inner_] = std::conj(chirp_[k]);
    }
    powers(wide_);
    chirp_terms_ = wide_;
}

// The transform of a line of inner_ numbers, in place.
void Fourier::powers(std::vector<Complex> &line) const {
    for (std::size_t i = 1, j = 0; i < inner_; ++i) { // each number to the place of its reversed bits
        std::size_t bit = inner_ >> 1;
        for (; (j & bit) != 0; bit >>= 1) {
            j ^= bit;
        }
        j ^= bit;
        if (i < j) {
            std::swap(line[i], line[j]);
        }
    }
    for (std::size_t half = 1; half < inner_; half *= 2) {
        const std::size_t step = inner_ / (2 * half);
        for (std::size_t start = 0; start < inner_; start += 2 * half) {
            for (std::size_t k = 0; k < half; ++k) {
                const Complex odd = product(line[start + half + k], roots_[k * step]);
                const Complex even = line[start + k];
                line[start + k] = even + odd;
                line[start + half + k] = even - odd;
            }
        }
    }
}

// The transform of a line of length_ numbers, in place.
void Fourier::forward(std::vector<Complex> &line) {
    if (inner_ == length_) {
        powers(line);
        return;
    }
    std::fill(wide_.begin(), wide_.end(), Complex());
    for (std::size_t k = 0; k < length_; ++k) {
        wide_[k] = product(line[k], chirp_[k]);
    }
    powers(wide_);
    for (std::size_t k = 0; k < inner_; ++k) {
        wide_[k] = std::conj(product(wide_[k], chirp_terms_[k]));
    }
    powers(wide_); // of the conjugate: the inverse, conjugated and times inner_
    const double scale = 1.0 / static_cast<double>(inner_);
    for (std::size_t k = 0; k < length_; ++k) {
        line[k] = product(std::conj(wide_[k]) * scale, chirp_[k]);
    }
}

void Fourier::slopes(std::span<double> a, std::span<double> b) {
    for (std::size_t i = 0; i < length_; ++i) {
        line_[i] = {a[i], b[i]}; // a slope is real where its line is: two lines never mix
    }
    forward(line_);
    const double unit = 2.0 * mathx::pi / static_cast<double>(length_);
    for (std::size_t k = 0; k < length_; ++k) {
        double wave = 0.0;
        if (2 * k < length_) {
            wave = static_cast<double>(k);
        } else if (2 * k > length_) {
            wave = -static_cast<double>(length_ - k);
        }
        // Times i wave, and conjugated, for the way back is the transform of the conjugate.
        line_[k] = std::conj(Complex{-line_[k].imag(), line_[k].real()} * (wave * unit));
    }
    forward(line_);
    const double scale = 1.0 / static_cast<double>(length_);
    for (std::size_t i = 0; i < length_; ++i) {
        a[i] = line_[i].real() * scale;
        b[i] = -line_[i].imag() * scale;
    }
}

namespace {

// `count` lines of `length` numbers, `next` apart and their numbers `step` apart -> their slopes, at most
// `together` lines at once.
void slopes_along(std::span<const float> heights, std::size_t count, std::size_t next, std::size_t length,
                  std::size_t step, std::span<float> out, int threads) {
    const Fourier plan(length);
    for_rows((count + together - 1) / together, threads, [&](std::size_t begin, std::size_t end) {
        Fourier fourier = plan;
        std::vector<double> lines(together * length);
        for (std::size_t group = begin; group < end; ++group) {
            const std::size_t first = group * together;
            const std::size_t some = std::min(together, count - first);
            std::fill(lines.begin(), lines.end(), 0.0);
            for (std::size_t k = 0; k < length; ++k) {
                for (std::size_t i = 0; i < some; ++i) {
                    lines[i * length + k] = heights[(first + i) * next + k * step];
                }
            }
            for (std::size_t i = 0; i < some; i += 2) {
                fourier.slopes({&lines[i * length], length}, {&lines[(i + 1) * length], length});
            }
            for (std::size_t k = 0; k < length; ++k) {
                for (std::size_t i = 0; i < some; ++i) {
                    out[(first + i) * next + k * step] = static_cast<float>(lines[i * length + k]);
                }
            }
        }
    });
}

} // namespace

Slopes spectral_slopes(std::span<const float> heights, std::size_t rows, std::size_t columns, int threads) {
    Slopes out{std::vector<float>(heights.size()), std::vector<float>(heights.size())};
    slopes_along(heights, rows, columns, columns, 1, out.x, threads);
    slopes_along(heights, columns, 1, rows, columns, out.y, threads);
    return out;
}

} // namespace paradize::reference
