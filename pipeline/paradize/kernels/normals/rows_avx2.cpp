// Rows of normals for AVX2.
#include "normals/shared.hpp"

#ifdef PARADIZE_WIDE
#include "simd/begin_avx2.hpp"

#include "normals/rows.hpp"
#pragma GCC pop_options
#endif
