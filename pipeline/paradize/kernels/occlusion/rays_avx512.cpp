// Rays for AVX-512.
#include "occlusion/cast.hpp"

#ifdef PARADIZE_WIDE
#include <immintrin.h>

#include "simd/begin_avx512.hpp"

#include "occlusion/rays.hpp"
#pragma GCC pop_options
#endif
