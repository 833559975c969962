#include "obj/number.hpp"

#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <system_error>

namespace paradize::obj {
namespace {

constexpr double powers_of_ten[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                    1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

constexpr double least_normal = 1e-37; // more than the least normal float32

// Of a double that is a normal float32 or none: whether it lies halfway between two of those.
bool is_halfway(double value) {
    return (std::bit_cast<std::uint64_t>(value) & 0x1fffffffu) == 0x10000000u;
}

// The part of the value's text that decides whether an out-of-range number is too large or too small.
bool is_tiny(const char *p, const char *end) {
    const char *exponent = p;
    while (exponent != end && *exponent != 'e' && *exponent != 'E')
        ++exponent;
    long double value = 0;
    const auto [stop, error] = std::from_chars(p, end, value);
    if (error == std::errc())
        return std::fabs(value) < 1;
    if (exponent != end && exponent + 1 != end)
        return exponent[1] == '-';
    for (const char *q = p; q != end && *q != '.'; ++q)
        if (*q >= '1' && *q <= '9')
            return false;
    return true;
}

template <typename Real>
NumberFault read_slowly(const char *&p, const char *end, bool negative, Real &out) {
    Real value = 0;
    const auto [stop, error] = std::from_chars(p, end, value);
    if (error == std::errc::invalid_argument)
        return NumberFault::garbage;
    if (error == std::errc::result_out_of_range) {
        if (!is_tiny(p, stop))
            return NumberFault::too_large;
        double wide = 0; // a denormal float may be reported as out of range too
        value = std::from_chars(p, end, wide).ec == std::errc() ? static_cast<Real>(wide) : 0;
    } else if (!std::isfinite(value)) {
        return NumberFault::not_finite;
    } else if (!std::isfinite(static_cast<float>(value))) {
        return NumberFault::too_large;
    }
    if constexpr (sizeof(Real) == sizeof(double)) {
        float nearest = 0;
        if ((is_halfway(value) || value < least_normal) &&
            std::from_chars(p, end, nearest).ec == std::errc() && static_cast<float>(value) != nearest)
            value = std::nextafter(value, static_cast<double>(nearest));
    }
    p = stop;
    out = negative ? -value : value;
    return NumberFault::none;
}

template <typename Real>
NumberFault read(const char *&p, const char *end, Real &out) {
    const char *const start = p;
    const char *q = p;
    const bool negative = q != end && *q == '-';
    if (q != end && (*q == '-' || *q == '+'))
        ++q;
    const char *const number = q;
    if (q != end && (*q == '-' || *q == '+'))
        return NumberFault::garbage;
    std::uint64_t mantissa = 0;
    int digits = 0;
    int scale = 0;
    for (; q != end && is_digit(*q); ++q, ++digits)
        mantissa = digits < 19 ? mantissa * 10 + static_cast<std::uint64_t>(*q - '0') : mantissa;
    if (q != end && *q == '.') {
        ++q;
        for (; q != end && is_digit(*q); ++q, ++digits, --scale)
            mantissa = digits < 19 ? mantissa * 10 + static_cast<std::uint64_t>(*q - '0') : mantissa;
    }
    bool fast = digits > 0 && digits <= 19 && mantissa < (std::uint64_t{1} << 53);
    if (q != end && (*q == 'e' || *q == 'E') && digits > 0) {
        const char *e = q + 1;
        const bool down = e != end && *e == '-';
        if (e != end && (*e == '-' || *e == '+'))
            ++e;
        int exponent = 0;
        int exponent_digits = 0;
        for (; e != end && is_digit(*e); ++e, ++exponent_digits)
            exponent = exponent < 10000 ? exponent * 10 + (*e - '0') : exponent;
        if (exponent_digits > 0) {
            q = e;
            scale += down ? -exponent : exponent;
        } else {
            fast = false;
        }
    }
    if (fast && scale >= -22 && scale <= 22) {
        const double m = static_cast<double>(mantissa);
        const double value = scale < 0 ? m / powers_of_ten[-scale] : m * powers_of_ten[scale];
        // Rounding twice (to double, then to float) is wrong only where the double lies halfway between
        // floats.
        const bool normal = value == 0 || (value > least_normal && value < std::numeric_limits<float>::max());
        if (normal && !is_halfway(value)) {
            p = q;
            out = static_cast<Real>(negative ? -value : value);
            return NumberFault::none;
        }
    }
    p = number;
    const NumberFault fault = read_slowly(p, end, negative, out);
    if (fault != NumberFault::none)
        p = start;
    return fault;
}

} // namespace

NumberFault read_number(const char *&p, const char *end, float &out) {
    return read(p, end, out);
}

NumberFault read_number(const char *&p, const char *end, double &out) {
    return read(p, end, out);
}

} // namespace paradize::obj
