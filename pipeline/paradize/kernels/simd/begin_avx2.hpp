// Code included after this, up to "#pragma GCC pop_options", is compiled for AVX2. Include first what is
// shared with others, standard headers too, so that nothing of it is.
#pragma GCC push_options
#pragma GCC target("avx2")
#define PARADIZE_WIDTH avx2
#define PARADIZE_LANES 8
