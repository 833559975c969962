// Rows of blocks for AVX-512. Standard headers come before the pragma, so that nothing shared is compiled for
// it.
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#include <immintrin.h>

#pragma GCC push_options
#pragma GCC target("avx512f,avx512vl,avx512dq,avx512bw")
#define PARADIZE_WIDTH avx512
#define PARADIZE_LANES 16
#include "bcn_rows.hpp"
#pragma GCC pop_options
#endif
