// Text in words of 64 bits: where digits end, and what up to eight of them are worth. Little endian.
#pragma once

#include <cstdint>
#include <cstring>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace paradize::obj {

// Bytes that may be read from `p` on: what `breaks` looks at, and a word at its last place.
inline constexpr int reach = 64 + 8;

// Bit i is set where p[i] is no digit, i = 0 .. 63.
inline std::uint64_t breaks(const char *p) {
#if defined(__SSE2__)
    const auto digits = [p](int at) {
        const __m128i bytes = _mm_loadu_si128(reinterpret_cast<const __m128i *>(p + at));
        const __m128i value = _mm_sub_epi8(bytes, _mm_set1_epi8('0'));
        const __m128i is = _mm_cmpeq_epi8(_mm_min_epu8(value, _mm_set1_epi8(9)), value);
        return static_cast<std::uint64_t>(static_cast<std::uint32_t>(_mm_movemask_epi8(is)));
    };
    return ~(digits(0) | digits(16) << 16 | digits(32) << 32 | digits(48) << 48);
#else
    std::uint64_t mask = 0;
    for (int at = 0; at < 64; ++at)
        mask |= static_cast<std::uint64_t>(static_cast<unsigned char>(p[at] - '0') > 9) << at;
    return mask;
#endif
}

// The value of the `count` digits at `p`, 1 to 8: pairs, then fours, then eight are joined by
// multiplications.
inline std::uint32_t digits(const char *p, unsigned count) {
    std::uint64_t word = 0;
    std::memcpy(&word, p, 8);
    word = (word << (64 - 8 * count)) & 0x0f0f0f0f0f0f0f0full;
    word = word * 10 + (word >> 8);
    return static_cast<std::uint32_t>((((word & 0x000000ff000000ffull) * 0x000f424000000064ull) +
                                       (((word >> 16) & 0x000000ff000000ffull) * 0x0000271000000001ull)) >>
                                      32);
}

} // namespace paradize::obj
