#include "filter/fft.hpp"

#include "math/functions.hpp"
#include "simd/cpu.hpp"

#include <algorithm>
#include <cstdint>

namespace paradize::filter {
namespace {

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

} // namespace

Fft::Fft(std::size_t n) : n_(n), turns_(2 * n) {
    for (std::size_t j = 0; j < n; ++j) {
        const Turn t = turn(j, n);
        turns_[2 * j] = t.re;
        turns_[2 * j + 1] = t.im;
    }
}

void Fft::forward(double *data, double *scratch) const {
    double *from = data;
    double *to = scratch;
    std::size_t left = n_;
    std::size_t stride = 1;
    while (left > 1) {
        const std::size_t r = left % 4 == 0 ? 4 : 2;
        left /= r;
        (r == 4 ? radix4 : radix2)(from, to, left, stride, turns_.data());
        std::swap(from, to);
        stride *= r;
    }
    if (from != data) {
        std::copy(from, from + n_ * element, data);
    }
}

} // namespace paradize::filter
