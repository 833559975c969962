// Angles between directions, without any function of libm but the square root. For metrics only.
#pragma once

#include <cstddef>

namespace paradize::reference {

// Three planes of vectors.
struct Directions {
    double *x;
    double *y;
    double *z;
};

// The unit vectors that a shader rebuilds from x and y: z = sqrt(max(0, 1 - x^2 - y^2)), normalised.
void rebuild(const double *x, const double *y, std::size_t count, Directions out);

// The vectors with length 1; (0, 0, 1) where they are shorter than 1e-7.
void normalise(const double *x, const double *y, const double *z, std::size_t count, Directions out);

// Degrees, 0 to 180, between unit vectors, exact for small angles too: 2 atan(|a - b| / |a + b|).
// Source: W. Kahan, "How futile are mindless assessments of roundoff", 2006.
void angles_between(Directions a, Directions b, std::size_t count, double *degrees);

} // namespace paradize::reference
