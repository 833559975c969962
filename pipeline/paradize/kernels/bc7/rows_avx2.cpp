// Rows of blocks for AVX2.
#include "bc7/shared.hpp"

#ifdef PARADIZE_WIDE
#include "simd/begin_avx2.hpp"

#include "bc7/rows.hpp"
#pragma GCC pop_options
#endif
