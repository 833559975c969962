// Rows of normals for AVX-512.
#include "normals_shared.hpp"

#ifdef PARADIZE_WIDE
#include "begin_avx512.hpp"

#include "normals_code_rows.hpp"
#pragma GCC pop_options
#endif
