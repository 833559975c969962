// Rows of blocks for AVX2.
#include "bc7_shared.hpp"

#ifdef PARADIZE_WIDE
#include "begin_avx2.hpp"

#include "bc7_rows.hpp"
#pragma GCC pop_options
#endif
