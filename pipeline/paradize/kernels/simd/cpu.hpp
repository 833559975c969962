// Instruction sets beyond the one that every CPU has: hot code is compiled for several, and the widest that
// the CPU runs is chosen at run time. No clone may fuse multiplication and addition (the build says
// -ffp-contract=off), so all give the same bits.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define PARADIZE_WIDE 1
#endif

// A hot loop in several clones, for functions whose lanes the compiler makes.
#if defined(PARADIZE_WIDE) && defined(__gnu_linux__) && !defined(__SANITIZE_ADDRESS__)
#define PARADIZE_CLONES __attribute__((target_clones("default", "avx2", "arch=x86-64-v4")))
#else
#define PARADIZE_CLONES
#endif

// Code whose lanes are written out stands in a header that is compiled once per set, in a namespace of its
// name
// (<topic>_rows_*.cpp). declare(name) for each of them.
#ifdef PARADIZE_WIDE
#define PARADIZE_EACH_WIDTH(declare) declare(baseline) declare(avx2) declare(avx512)
#else
#define PARADIZE_EACH_WIDTH(declare) declare(baseline)
#endif

namespace paradize {

// Whether the CPU runs what simd/begin_avx2.hpp and simd/begin_avx512.hpp compile for.
inline bool has_avx2() {
#ifdef PARADIZE_WIDE
    return __builtin_cpu_supports("avx2");
#else
    return false;
#endif
}

inline bool has_avx512() {
#ifdef PARADIZE_WIDE
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
           __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw");
#else
    return false;
#endif
}

} // namespace paradize
