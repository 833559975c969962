// Code included after this, up to "#pragma GCC pop_options", is compiled for AVX-512. Include first what
// is shared with others, standard headers too, so that nothing of it is.
#pragma GCC push_options
#pragma GCC target("avx512f,avx512vl,avx512dq,avx512bw")
#define PARADIZE_WIDTH avx512
#define PARADIZE_LANES 16
