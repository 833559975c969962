// Rows of normals for AVX-512.
#include "normals/shared.hpp"

#ifdef PARADIZE_WIDE
#include "simd/begin_avx512.hpp"

#include "normals/rows.hpp"
#pragma GCC pop_options
#endif
