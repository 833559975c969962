// Elementary functions out of + - * / and sqrt alone: the same bits on every CPU and C library.
// The last bits of libm and of numpy's transcendentals differ between machines, so nothing that reaches an
// artifact may call them; kernels call these. Errors below are measured against mpmath
// (tests/pipeline/kernels/test_math.py).
//
// Sources of the reductions: W. J. Cody and W. Waite, "Software Manual for the Elementary Functions", 1980
// (exp, sin, cos); P. T. P. Tang, "Table-driven implementation of the logarithm function", 1990 (the form of
// log); the series are Taylor's.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace paradize::mathx {

inline constexpr double pi = 0x1.921fb54442d18p+1;
inline constexpr double half_pi = 0x1.921fb54442d18p+0;
inline constexpr double half_pi_low = 0x1.1a62633145c07p-54; // pi/2 - half_pi
inline constexpr double ln2_high = 0x1.62e42feep-1;          // 32 bits, so that k * ln2_high is exact
inline constexpr double ln2_low = 0x1.a39ef35793c76p-33;
inline constexpr double infinity = std::numeric_limits<double>::infinity();
inline constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// 2^k for -1022 <= k <= 1023, exactly.
constexpr double power_of_two(int k) {
    return std::bit_cast<double>(static_cast<std::uint64_t>(k + 1023) << 52);
}

// x * 2^k, exactly where the result is normal.
constexpr double scale(double x, int k) {
    while (k > 1023) {
        x *= power_of_two(1023);
        k -= 1023;
    }
    while (k < -1022) {
        x *= power_of_two(-1022);
        k += 1022;
    }
    return x * power_of_two(k);
}

// The nearest integer to x for |x| < 2^51, halves to even.
constexpr double nearest(double x) {
    constexpr double shift = 0x1.8p+52;
    return (x + shift) - shift;
}

// e^x. Relative error below 2e-16 where the result is normal; 0 and infinity beyond.
constexpr double exp(double x) {
    if (!(x == x)) {
        return nan;
    }
    if (x > 709.79) {
        return infinity;
    }
    if (x < -745.14) {
        return 0.0;
    }
    const double k = nearest(x * 0x1.71547652b82fep+0);
    const double high = x - k * ln2_high;
    const double low = k * ln2_low;
    const double r = high - low; // |r| <= ln2 / 2
    double sum = 1.0 / 6227020800.0;
    constexpr std::array<double, 11> inverse_factorials = {
        1.0 / 479001600.0, 1.0 / 39916800.0, 1.0 / 3628800.0, 1.0 / 362880.0, 1.0 / 40320.0, 1.0 / 5040.0,
        1.0 / 720.0,       1.0 / 120.0,      1.0 / 24.0,      1.0 / 6.0,      1.0 / 2.0};
    for (const double c : inverse_factorials) {
        sum = sum * r + c;
    }
    const double lost = (high - r) - low; // what rounding took from r
    return scale(1.0 + (r + (r * r * sum + lost)), static_cast<int>(k));
}

// Natural logarithm. Relative error below 3e-16; log(0) = -infinity, log of a negative number is NaN.
constexpr double log(double x) {
    if (!(x >= 0.0)) {
        return nan;
    }
    if (x == 0.0) {
        return -infinity;
    }
    if (x == infinity) {
        return infinity;
    }
    int k = 0;
    if (x < 0x1p-1022) {
        x *= 0x1p54;
        k = -54;
    }
    const auto bits = std::bit_cast<std::uint64_t>(x);
    k += static_cast<int>(bits >> 52) - 1023;
    double m = std::bit_cast<double>((bits & 0xfffffffffffffULL) | 0x3ff0000000000000ULL);
    if (m > 0x1.6a09e667f3bcdp+0) { // sqrt 2
        m *= 0.5;
        ++k;
    }
    const double f = m - 1.0;
    const double s = f / (2.0 + f); // log(1 + f) = 2 (s + s^3/3 + s^5/5 + ...), |s| <= 0.1716
    const double z = s * s;
    double sum = 2.0 / 21.0;
    for (int n = 19; n >= 3; n -= 2) {
        sum = sum * z + 2.0 / n;
    }
    const double rest = sum * z; // log(1 + f) = f - f^2/2 + s (f^2/2 + rest)
    const double half_square = 0.5 * f * f;
    return k * ln2_high - ((half_square - (s * (half_square + rest) + k * ln2_low)) - f);
}

// x^y for x >= 0. Relative error below (3 + |y ln x|) * 2e-16; pow(x, 0) = 1; NaN for negative x.
constexpr double pow(double x, double y) {
    if (y == 0.0 || x == 1.0) {
        return 1.0;
    }
    if (x == 0.0) {
        return y > 0.0 ? 0.0 : infinity;
    }
    return exp(y * log(x));
}

namespace detail {

struct Reduced {
    double r;    // |r| <= pi/4
    double tail; // what rounding took from r
    int quarter; // multiples of pi/2 taken away, modulo 4
};

// Cody and Waite's reduction in three parts: exact for |x| < 2^19 * pi/2.
constexpr Reduced reduce(double x) {
    constexpr double first = 0x1.921fb544p+0;   // 33 bits of pi/2
    constexpr double second = 0x1.0b4611a6p-34; // the next 33
    constexpr double third = 0x1.3198a2e037073p-69;
    const double k = nearest(x * 0x1.45f306dc9c883p-1);
    const double a = x - k * first;
    const double b = k * second;
    const double high = a - b;
    const double low = ((a - high) - b) - k * third;
    const double r = high + low;
    const double quarter = k - 4.0 * nearest(k * 0.25);
    return {r, (high - r) + low, (static_cast<int>(quarter) + 4) & 3};
}

constexpr double sin_part(double r, double tail) {
    const double z = r * r;
    double sum = 1.0 / 355687428096000.0;
    constexpr std::array<double, 6> coefficients = {-1.0 / 1307674368000.0, 1.0 / 6227020800.0,
                                                    -1.0 / 39916800.0,      1.0 / 362880.0,
                                                    -1.0 / 5040.0,          1.0 / 120.0};
    for (const double c : coefficients) {
        sum = sum * z + c;
    }
    return r + ((r * z * (sum * z - 1.0 / 6.0)) + tail * (1.0 - 0.5 * z));
}

constexpr double cos_part(double r, double tail) {
    const double z = r * r;
    double sum = 1.0 / 20922789888000.0;
    constexpr std::array<double, 6> coefficients = {-1.0 / 87178291200.0, 1.0 / 479001600.0, -1.0 / 3628800.0,
                                                    1.0 / 40320.0,        -1.0 / 720.0,      1.0 / 24.0};
    for (const double c : coefficients) {
        sum = sum * z + c;
    }
    const double half = 0.5 * z;
    const double whole = 1.0 - half;
    return whole + (((1.0 - whole) - half) + (z * z * sum - r * tail));
}

} // namespace detail

// Sine of x radians, |x| < 8e5. Absolute error below 2e-16.
constexpr double sin(double x) {
    if (!(x > -1e15 && x < 1e15)) {
        return nan;
    }
    const detail::Reduced a = detail::reduce(x);
    const double part = (a.quarter & 1) != 0 ? detail::cos_part(a.r, a.tail) : detail::sin_part(a.r, a.tail);
    return (a.quarter & 2) != 0 ? -part : part;
}

// Cosine of x radians, |x| < 8e5. Absolute error below 2e-16.
constexpr double cos(double x) {
    if (!(x > -1e15 && x < 1e15)) {
        return nan;
    }
    const detail::Reduced a = detail::reduce(x);
    const double part = (a.quarter & 1) != 0 ? detail::sin_part(a.r, a.tail) : detail::cos_part(a.r, a.tail);
    return a.quarter == 1 || a.quarter == 2 ? -part : part;
}

// Arc tangent, radians in [-pi/2, pi/2]. Relative error below 4e-16.
constexpr double atan(double x) {
    if (!(x == x)) {
        return nan;
    }
    const double a = x < 0.0 ? -x : x;
    const bool steep = a > 1.0;
    const double t = steep ? 1.0 / a : a;
    // atan(t) = atan(c) + atan((t - c) / (1 + t c)) with c the nearest eighth: |z| <= 1/16.
    constexpr std::array<double, 9> eighths = {0.0,
                                               0x1.fd5ba9aac2f6ep-4,
                                               0x1.f5b75f92c80ddp-3,
                                               0x1.6f61941e4def1p-2,
                                               0x1.dac670561bb4fp-2,
                                               0x1.1e00babdefeb4p-1,
                                               0x1.4978fa3269ee1p-1,
                                               0x1.700a7c5784634p-1,
                                               0x1.921fb54442d18p-1};
    const int eighth = static_cast<int>(t * 8.0 + 0.5);
    const double c = eighth * 0.125;
    const double z = (t - c) / (1.0 + t * c);
    const double square = z * z;
    double sum = 1.0 / 13.0;
    for (int n = 11; n >= 3; n -= 2) {
        sum = 1.0 / n - sum * square;
    }
    const double angle = eighths[static_cast<std::size_t>(eighth)] + (z - z * square * sum);
    const double whole = steep ? half_pi - (angle - half_pi_low) : angle;
    return x < 0.0 ? -whole : whole;
}

// The angle of the point (x, y) from +x, radians in [-pi, pi]. atan2(0, 0) = 0. Relative error below 5e-16.
constexpr double atan2(double y, double x) {
    if (!(x == x) || !(y == y)) {
        return nan;
    }
    if (y == 0.0) {
        return x < 0.0 ? pi : 0.0;
    }
    if (x == 0.0) {
        return y > 0.0 ? half_pi : -half_pi;
    }
    const double angle = atan(y / x);
    if (x > 0.0) {
        return angle;
    }
    return y > 0.0 ? angle + pi : angle - pi;
}

// Arc cosine of x, clamped to [-1, 1], radians in [0, pi]. Relative error below 1e-15, near 1 and -1 too.
inline double acos(double x) {
    if (!(x == x)) {
        return nan;
    }
    if (x >= 1.0) {
        return 0.0;
    }
    if (x <= -1.0) {
        return pi;
    }
    return 2.0 * atan2(std::sqrt(1.0 - x), std::sqrt(1.0 + x));
}

// sRGB (IEC 61966-2-1) decoding and encoding; continued to negative values by symmetry, above 1 by the curve.
constexpr double srgb_to_linear(double v) {
    const double a = v < 0.0 ? -v : v;
    const double linear = a <= 0.04045 ? a / 12.92 : pow((a + 0.055) / 1.055, 2.4);
    return v < 0.0 ? -linear : linear;
}

constexpr double linear_to_srgb(double v) {
    const double a = v < 0.0 ? -v : v;
    const double encoded = a <= 0.0031308 ? a * 12.92 : 1.055 * pow(a, 1.0 / 2.4) - 0.055;
    return v < 0.0 ? -encoded : encoded;
}

} // namespace paradize::mathx
