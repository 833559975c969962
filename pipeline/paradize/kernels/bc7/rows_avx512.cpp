// Rows of blocks for AVX-512.
#include "bc7/shared.hpp"

#ifdef PARADIZE_WIDE
#include "simd/begin_avx512.hpp"

#include "bc7/rows.hpp"
#pragma GCC pop_options
#endif
