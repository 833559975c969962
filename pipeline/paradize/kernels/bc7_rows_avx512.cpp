// Rows of blocks for AVX-512. What is shared comes before the pragma, so that none of it is compiled for
// AVX-512.
#include <cstddef>
#include <cstdint>
#include <initializer_list>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#include "bc7_pack.hpp"
#include "bc7_picture.hpp"

#pragma GCC push_options
#pragma GCC target("avx512f,avx512vl,avx512dq,avx512bw")
#define PARADIZE_WIDTH avx512
#define PARADIZE_LANES 16
#include "bc7_rows.hpp"
#pragma GCC pop_options
#endif
