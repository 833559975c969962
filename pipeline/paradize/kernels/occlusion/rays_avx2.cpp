// Rays for AVX2.
#include "occlusion/cast.hpp"

#ifdef PARADIZE_WIDE
#include <immintrin.h>

#include "simd/begin_avx2.hpp"

#include "occlusion/rays.hpp"
#pragma GCC pop_options
#endif
