#include "filter/fft.hpp"

#include "math/functions.hpp"
#include "simd/cpu.hpp"

#include <algorithm>
#include <cstdint>

namespace paradize::filter {
namespace {

constexpr std::size_t largest_prime = 31; // beyond it Bluestein's way is quicker than the plain sum

struct Turn {
    double re;
    double im;
};

// e^(-2 pi i j / n) with its angle reduced to an eighth of a turn, so that it is right to the last bit or
// two.
Turn turn(std::uint64_t j, std::uint64_t n) {
    const std::uint64_t eighth = 8 * (j % n) / n;
    const std::uint64_t even = (eighth + 1) / 2; // the nearest quarter turn
    const auto rest = static_cast<double>(static_cast<std::int64_t>(4 * (j % n)) -
                                          static_cast<std::int64_t>(even * n)); // in units of a turn / (4 n)
    const double angle = rest * mathx::half_pi / static_cast<double>(n);
    const double c = mathx::cos(angle);
    const double s = mathx::sin(angle);
    switch (even & 3) {
    case 0:
        return {c, -s};
    case 1:
        return {-s, -c};
    case 2:
        return {-c, s};
    default:
        return {s, c};
    }
}

// One pass over m * r * s samples: m butterflies of radix r for each of s signals that lie side by side.
PARADIZE_CLONES void radix2(const double *__restrict x, double *__restrict y, std::size_t m, std::size_t s,
                            const double *__restrict turns) {
    const std::size_t run = s * element;
    for (std::size_t p = 0; p < m; ++p) {
        const double wr = turns[2 * p * s];
        const double wi = turns[2 * p * s + 1];
        const double *a = x + p * run;
        const double *b = x + (p + m) * run;
        double *to = y + 2 * p * run;
        double *far = to + run;
        for (std::size_t q = 0; q < run; q += element) {
            for (std::size_t l = q; l < q + lanes; ++l) {
                const double dr = a[l] - b[l];
                const double di = a[l + lanes] - b[l + lanes];
                to[l] = a[l] + b[l];
                to[l + lanes] = a[l + lanes] + b[l + lanes];
                far[l] = dr * wr - di * wi;
                far[l + lanes] = dr * wi + di * wr;
            }
        }
    }
}

PARADIZE_CLONES void radix4(const double *__restrict x, double *__restrict y, std::size_t m, std::size_t s,
                            const double *__restrict turns) {
    const std::size_t run = s * element;
    for (std::size_t p = 0; p < m; ++p) {
        const double *w = turns + 2 * p * s;
        const double w1r = w[0];
        const double w1i = w[1];
        const double w2r = turns[4 * p * s];
        const double w2i = turns[4 * p * s + 1];
        const double w3r = turns[6 * p * s];
        const double w3i = turns[6 * p * s + 1];
        const double *a = x + p * run;
        const double *b = a + m * run;
        const double *c = b + m * run;
        const double *d = c + m * run;
        double *y0 = y + 4 * p * run;
        double *y1 = y0 + run;
        double *y2 = y1 + run;
        double *y3 = y2 + run;
        for (std::size_t q = 0; q < run; q += element) {
            for (std::size_t l = q; l < q + lanes; ++l) {
                const std::size_t i = l + lanes;
                const double acr = a[l] + c[l];
                const double aci = a[i] + c[i];
                const double amr = a[l] - c[l];
                const double ami = a[i] - c[i];
                const double bdr = b[l] + d[l];
                const double bdi = b[i] + d[i];
                const double bmr = b[l] - d[l];
                const double bmi = b[i] - d[i];
                y0[l] = acr + bdr;
                y0[i] = aci + bdi;
                const double er = amr + bmi; // a - c - i (b - d)
                const double ei = ami - bmr;
                y1[l] = er * w1r - ei * w1i;
                y1[i] = er * w1i + ei * w1r;
                const double fr = acr - bdr;
                const double fi = aci - bdi;
                y2[l] = fr * w2r - fi * w2i;
                y2[i] = fr * w2i + fi * w2r;
                const double gr = amr - bmi;
                const double gi = ami + bmr;
                y3[l] = gr * w3r - gi * w3i;
                y3[i] = gr * w3i + gi * w3r;
            }
        }
    }
}

// Any small radix, by its definition. jump: n / r, the step of the r-th roots of one in `turns`.
PARADIZE_CLONES void radix_any(const double *__restrict x, double *__restrict y, std::size_t r, std::size_t m,
                               std::size_t s, std::size_t jump, const double *__restrict turns) {
    const std::size_t run = s * element;
    for (std::size_t p = 0; p < m; ++p) {
        for (std::size_t k = 0; k < r; ++k) {
            const double wr = turns[2 * p * k * s];
            const double wi = turns[2 * p * k * s + 1];
            for (std::size_t q = 0; q < run; q += element) {
                double sum_re[lanes] = {};
                double sum_im[lanes] = {};
                for (std::size_t j = 0; j < r; ++j) {
                    const double cr = turns[2 * (j * k % r) * jump];
                    const double ci = turns[2 * (j * k % r) * jump + 1];
                    const double *a = x + (p + m * j) * run + q;
                    for (std::size_t l = 0; l < lanes; ++l) {
                        sum_re[l] += a[l] * cr - a[l + lanes] * ci;
                        sum_im[l] += a[l] * ci + a[l + lanes] * cr;
                    }
                }
                double *to = y + (r * p + k) * run + q;
                for (std::size_t l = 0; l < lanes; ++l) {
                    to[l] = sum_re[l] * wr - sum_im[l] * wi;
                    to[l + lanes] = sum_re[l] * wi + sum_im[l] * wr;
                }
            }
        }
    }
}

// to[j] = from[j] * factor[j], a complex factor for each of n samples.
PARADIZE_CLONES void multiply(const double *__restrict from, const double *__restrict factors, std::size_t n,
                              double *__restrict to) {
    for (std::size_t j = 0; j < n; ++j) {
        const double wr = factors[2 * j];
        const double wi = factors[2 * j + 1];
        const double *a = from + j * element;
        double *b = to + j * element;
        for (std::size_t l = 0; l < lanes; ++l) {
            b[l] = a[l] * wr - a[l + lanes] * wi;
            b[l + lanes] = a[l] * wi + a[l + lanes] * wr;
        }
    }
}

// The same, with the parts of each product exchanged: multiply(), then what an inverse transform begins with.
PARADIZE_CLONES void multiply_exchanged(double *__restrict data, const double *__restrict factors,
                                        std::size_t n) {
    for (std::size_t j = 0; j < n; ++j) {
        const double wr = factors[2 * j];
        const double wi = factors[2 * j + 1];
        double *a = data + j * element;
        for (std::size_t l = 0; l < lanes; ++l) {
            const double re = a[l] * wr - a[l + lanes] * wi;
            a[l] = a[l] * wi + a[l + lanes] * wr;
            a[l + lanes] = re;
        }
    }
}

// data[j] = (the parts of from[j] exchanged) * factor[j].
PARADIZE_CLONES void exchange_multiply(const double *__restrict from, const double *__restrict factors,
                                       std::size_t n, double *__restrict data) {
    for (std::size_t j = 0; j < n; ++j) {
        const double wr = factors[2 * j];
        const double wi = factors[2 * j + 1];
        const double *a = from + j * element;
        double *b = data + j * element;
        for (std::size_t l = 0; l < lanes; ++l) {
            b[l] = a[l + lanes] * wr - a[l] * wi;
            b[l + lanes] = a[l + lanes] * wi + a[l] * wr;
        }
    }
}

// The factors of n, fours first; empty where one is above the largest prime that is worth a pass.
std::vector<std::size_t> factors_of(std::size_t n) {
    std::vector<std::size_t> found;
    for (const std::size_t r : {std::size_t{4}, std::size_t{2}}) {
        for (; n % r == 0; n /= r) {
            found.push_back(r);
        }
    }
    for (std::size_t r = 3; r <= largest_prime; r += 2) {
        for (; n % r == 0; n /= r) {
            found.push_back(r);
        }
    }
    return n == 1 ? found : std::vector<std::size_t>{};
}

} // namespace

Fft::Fft(std::size_t n) : n_(n), factors_(factors_of(n)) {
    if (n == 1) {
        return;
    }
    if (!factors_.empty()) {
        turns_.resize(2 * n);
        for (std::size_t j = 0; j < n; ++j) {
            const Turn t = turn(j, n);
            turns_[2 * j] = t.re;
            turns_[2 * j + 1] = t.im;
        }
        return;
    }
    std::size_t size = 1;
    while (size < 2 * n - 1) {
        size *= 2;
    }
    longer_ = std::make_unique<Fft>(size);
    chirp_.resize(2 * n);
    std::vector<double> kernel(size * element, 0.0);
    const double scale = 1.0 / static_cast<double>(size); // a power of two: exact
    for (std::size_t j = 0; j < n; ++j) {
        const Turn t = turn(static_cast<std::uint64_t>(j) * j % (2 * n), 2 * n);
        chirp_[2 * j] = t.re;
        chirp_[2 * j + 1] = t.im;
        for (const std::size_t at : {j, (size - j) % size}) {
            kernel[at * element] = t.re * scale;
            kernel[at * element + lanes] = -t.im * scale;
        }
    }
    std::vector<double> scratch(longer_->scratch_size());
    longer_->forward(kernel.data(), scratch.data());
    response_.resize(2 * size);
    for (std::size_t j = 0; j < size; ++j) {
        response_[2 * j] = kernel[j * element];
        response_[2 * j + 1] = kernel[j * element + lanes];
    }
}

std::size_t Fft::scratch_size() const {
    if (longer_) {
        return longer_->size() * element + longer_->scratch_size();
    }
    return n_ * element;
}

void Fft::forward(double *data, double *scratch) const {
    if (longer_) {
        bluestein(data, scratch);
    } else {
        stockham(data, scratch);
    }
}

void Fft::stockham(double *data, double *scratch) const {
    double *from = data;
    double *to = scratch;
    std::size_t left = n_;
    std::size_t stride = 1;
    for (const std::size_t r : factors_) {
        const std::size_t m = left / r;
        if (r == 4) {
            radix4(from, to, m, stride, turns_.data());
        } else if (r == 2) {
            radix2(from, to, m, stride, turns_.data());
        } else {
            radix_any(from, to, r, m, stride, n_ / r, turns_.data());
        }
        std::swap(from, to);
        left = m;
        stride *= r;
    }
    if (from != data) {
        std::copy(from, from + n_ * element, data);
    }
}

void Fft::bluestein(double *data, double *scratch) const {
    const std::size_t size = longer_->size();
    double *rest = scratch + size * element;
    multiply(data, chirp_.data(), n_, scratch);
    std::fill(scratch + n_ * element, rest, 0.0);
    longer_->forward(scratch, rest);
    multiply_exchanged(scratch, response_.data(), size);
    longer_->forward(scratch, rest);
    exchange_multiply(scratch, chirp_.data(), n_, data);
}

} // namespace paradize::filter
