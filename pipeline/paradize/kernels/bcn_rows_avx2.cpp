// Rows of blocks for AVX2. Standard headers come before the pragma, so that nothing shared is compiled for
// it.
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#include <immintrin.h>

#pragma GCC push_options
#pragma GCC target("avx2")
#define PARADIZE_WIDTH avx2
#define PARADIZE_LANES 8
#include "bcn_rows.hpp"
#pragma GCC pop_options
#endif
