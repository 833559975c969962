// Rows of blocks for AVX2.
#include "bcn_shared.hpp"

#ifdef PARADIZE_WIDE
#include "begin_avx2.hpp"

#include "bcn_rows.hpp"
#pragma GCC pop_options
#endif
