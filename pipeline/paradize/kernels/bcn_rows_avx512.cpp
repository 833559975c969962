// Rows of blocks for AVX-512.
#include "bcn_shared.hpp"

#ifdef PARADIZE_WIDE
#include "begin_avx512.hpp"

#include "bcn_rows.hpp"
#pragma GCC pop_options
#endif
