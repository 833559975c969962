#include "filter/spectral.hpp"

#include "filter/fft.hpp"
#include "math/functions.hpp"
#include "parallel.hpp"
#include "simd/cpu.hpp"

#include <algorithm>
#include <limits>
#include <vector>

namespace paradize::filter {
namespace {

constexpr std::size_t block = 2 * lanes; // real lines of one transform: two share a complex signal

// factors[k]: the wave number of bin k in radians per texel, over n for the two transforms.
std::vector<double> wave_numbers(std::size_t n) {
    std::vector<double> factors(n, 0.0);
    const double unit = 2.0 * mathx::pi / static_cast<double>(n) / static_cast<double>(n);
    for (std::size_t k = 1; 2 * k < n; ++k) {
        factors[k] = unit * static_cast<double>(k);
        factors[n - k] = -factors[k];
    }
    return factors;
}

// X -> the exchanged parts of i k X: a derivative is a real factor on two real signals at once.
PARADIZE_CLONES void differentiate(double *__restrict data, const double *__restrict factors, std::size_t n) {
    for (std::size_t j = 0; j < n; ++j) {
        const double k = factors[j];
        double *a = data + j * element;
        for (std::size_t l = 0; l < lanes; ++l) {
            a[l] = k * a[l];
            a[l + lanes] = -k * a[l + lanes];
        }
    }
}

float narrow(double v) {
    constexpr double largest = std::numeric_limits<float>::max();
    return static_cast<float>(std::clamp(v, -largest, largest));
}

// Lines of n samples: line i begins at i * step, its samples are `apart` texels from each other.
struct Lines {
    std::size_t count;
    std::size_t n;
    std::size_t step;
    std::size_t apart;
};

class Worker {
  public:
    Worker(const Fft &fft, const std::vector<double> &factors)
        : fft_(fft), factors_(factors), data_(fft.size() * element), scratch_(fft.scratch_size()) {}

    // The lines first .. first + block - 1, as far as there are so many.
    void work(const float *heights, const Lines &lines_of, std::size_t first, float *slopes) {
        const std::size_t used = std::min(block, lines_of.count - first);
        double base[block] = {};
        for (std::size_t i = 0; i < used; ++i) {
            base[i] = heights[(first + i) * lines_of.step];
        }
        for (std::size_t j = 0; j < lines_of.n; ++j) {
            const float *from = heights + first * lines_of.step + j * lines_of.apart;
            double *to = data_.data() + j * element;
            for (std::size_t i = 0; i < used; ++i) {
                to[i] = from[i * lines_of.step] - base[i];
            }
            std::fill(to + used, to + block, 0.0);
        }
        fft_.forward(data_.data(), scratch_.data());
        differentiate(data_.data(), factors_.data(), lines_of.n);
        fft_.forward(data_.data(), scratch_.data());
        for (std::size_t j = 0; j < lines_of.n; ++j) {
            const double *from = data_.data() + j * element;
            float *to = slopes + first * lines_of.step + j * lines_of.apart;
            for (std::size_t i = 0; i < used; ++i) {
                to[i * lines_of.step] = narrow(from[i < lanes ? i + lanes : i - lanes]);
            }
        }
    }

  private:
    const Fft &fft_;
    const std::vector<double> &factors_;
    std::vector<double> data_;
    std::vector<double> scratch_;
};

void along(const float *heights, const Lines &lines_of, float *slopes, int threads) {
    const Fft fft(lines_of.n);
    const std::vector<double> factors = wave_numbers(lines_of.n);
    for_rows((lines_of.count + block - 1) / block, threads, [&](std::size_t first, std::size_t last) {
        Worker worker(fft, factors);
        for (std::size_t b = first; b < last; ++b) {
            worker.work(heights, lines_of, b * block, slopes);
        }
    });
}

} // namespace

void spectral_slopes(std::span<const float> heights, std::size_t rows, std::size_t columns,
                     std::span<float> dx, std::span<float> dy, int threads) {
    if (rows == 0 || columns == 0) {
        return;
    }
    along(heights.data(), {rows, columns, columns, 1}, dx.data(), threads);
    along(heights.data(), {columns, rows, 1, columns}, dy.data(), threads);
}

} // namespace paradize::filter
