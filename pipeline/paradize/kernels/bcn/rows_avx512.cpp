// Rows of blocks for AVX-512.
#include "bcn/shared.hpp"

#ifdef PARADIZE_WIDE
#include "simd/begin_avx512.hpp"

#include "bcn/rows.hpp"
#pragma GCC pop_options
#endif
