// Rows of blocks for AVX2.
#include "bcn/shared.hpp"

#ifdef PARADIZE_WIDE
#include "simd/begin_avx2.hpp"

#include "bcn/rows.hpp"
#pragma GCC pop_options
#endif
