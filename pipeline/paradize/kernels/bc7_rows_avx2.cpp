// Rows of blocks for AVX2. What is shared comes before the pragma, so that none of it is compiled for AVX2.
#include <cstddef>
#include <cstdint>
#include <initializer_list>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#include "bc7_pack.hpp"
#include "bc7_picture.hpp"

#pragma GCC push_options
#pragma GCC target("avx2")
#define PARADIZE_WIDTH avx2
#define PARADIZE_LANES 8
#include "bc7_rows.hpp"
#pragma GCC pop_options
#endif
