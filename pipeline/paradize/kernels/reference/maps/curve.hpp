// The sRGB curve in float64 by roots and Newton's method. For metrics only: shares nothing with the stages'.
// Source: IEC 61966-2-1, "Default RGB colour space - sRGB", 1999.
#pragma once

#include <cstddef>

namespace paradize::reference {

// Encoded values -> linear light, both 0..1; values beyond are clipped. Relative error below 1e-15.
void decode_srgb(const double *encoded, std::size_t count, double *linear);

// Linear light -> encoded values, both 0..1; values beyond are clipped. Relative error below 1e-15.
void encode_srgb(const double *linear, std::size_t count, double *encoded);

} // namespace paradize::reference
