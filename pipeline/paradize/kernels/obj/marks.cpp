// Standard headers come before the pragmas, so that nothing shared is compiled for wider CPUs.
#include "obj/marks.hpp"

#include <cstring>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace paradize::obj {
namespace {

using Mark = void(const char *, std::size_t, std::uint64_t *, std::uint64_t *);

void mark_narrow(const char *text, std::size_t words, std::uint64_t *breaks, std::uint64_t *ends) {
    for (std::size_t word = 0; word < words; ++word) {
        std::uint64_t digits = 0, lines = 0;
#if defined(__SSE2__)
        for (int at = 0; at < 64; at += 16) {
            const __m128i bytes = _mm_loadu_si128(reinterpret_cast<const __m128i *>(text + 64 * word + at));
            const __m128i value = _mm_sub_epi8(bytes, _mm_set1_epi8('0'));
            const __m128i is_digit = _mm_cmpeq_epi8(_mm_min_epu8(value, _mm_set1_epi8(9)), value);
            const __m128i is_end = _mm_cmpeq_epi8(bytes, _mm_set1_epi8('\n'));
            digits |= std::uint64_t{static_cast<std::uint32_t>(_mm_movemask_epi8(is_digit))} << at;
            lines |= std::uint64_t{static_cast<std::uint32_t>(_mm_movemask_epi8(is_end))} << at;
        }
#else
        for (int at = 0; at < 64; ++at) {
            const char c = text[64 * word + static_cast<std::size_t>(at)];
            digits |= std::uint64_t{c >= '0' && c <= '9'} << at;
            lines |= std::uint64_t{c == '\n'} << at;
        }
#endif
        breaks[word] = ~digits;
        ends[word] = lines;
    }
}

} // namespace
} // namespace paradize::obj

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)

#pragma GCC push_options
#pragma GCC target("avx2")
namespace paradize::obj {
namespace {

void mark_avx2(const char *text, std::size_t words, std::uint64_t *breaks, std::uint64_t *ends) {
    const __m256i zero = _mm256_set1_epi8('0'), nine = _mm256_set1_epi8(9), line = _mm256_set1_epi8('\n');
    for (std::size_t word = 0; word < words; ++word) {
        std::uint64_t digits = 0, lines = 0;
        for (int at = 0; at < 64; at += 32) {
            const __m256i bytes =
                _mm256_loadu_si256(reinterpret_cast<const __m256i *>(text + 64 * word + at));
            const __m256i value = _mm256_sub_epi8(bytes, zero);
            const __m256i is_digit = _mm256_cmpeq_epi8(_mm256_min_epu8(value, nine), value);
            const __m256i is_end = _mm256_cmpeq_epi8(bytes, line);
            digits |= std::uint64_t{static_cast<std::uint32_t>(_mm256_movemask_epi8(is_digit))} << at;
            lines |= std::uint64_t{static_cast<std::uint32_t>(_mm256_movemask_epi8(is_end))} << at;
        }
        breaks[word] = ~digits;
        ends[word] = lines;
    }
}

} // namespace
} // namespace paradize::obj
#pragma GCC pop_options

#pragma GCC push_options
#pragma GCC target("avx512f,avx512bw")
namespace paradize::obj {
namespace {

void mark_avx512(const char *text, std::size_t words, std::uint64_t *breaks, std::uint64_t *ends) {
    const __m512i zero = _mm512_set1_epi8('0'), nine = _mm512_set1_epi8(9), line = _mm512_set1_epi8('\n');
    for (std::size_t word = 0; word < words; ++word) {
        const __m512i bytes = _mm512_loadu_si512(text + 64 * word);
        breaks[word] = _mm512_cmpgt_epu8_mask(_mm512_sub_epi8(bytes, zero), nine);
        ends[word] = _mm512_cmpeq_epi8_mask(bytes, line);
    }
}

} // namespace
} // namespace paradize::obj
#pragma GCC pop_options

#endif

namespace paradize::obj {
namespace {

Mark *widest() {
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw"))
        return mark_avx512;
    if (__builtin_cpu_supports("avx2"))
        return mark_avx2;
#endif
    return mark_narrow;
}

} // namespace

void mark(const char *text, std::size_t words, std::uint64_t *breaks, std::uint64_t *ends) {
    static Mark *const chosen = widest();
    chosen(text, words, breaks, ends);
}

} // namespace paradize::obj
