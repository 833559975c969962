// Runs of plain lines for AVX2 and BMI2. Standard headers come before the pragma, so that nothing shared is
// compiled for it; what shared headers define inline is not called behind it.
// Source of the digits' way into a vector: W. Mula, "SIMD-ized parsing of numbers", 2014 (multiply-add of
// neighbouring digits, pairs and fours).
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "obj/lines.hpp"

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#include <immintrin.h>

#pragma GCC push_options
#pragma GCC target("avx2,bmi,bmi2")

namespace paradize::obj {
namespace {

// For each number of whole digits 0 to 7: its bytes go to places 0 to 7, the last at 7; those behind the
// point follow from 8 on. And for each number of digits behind the point, which of these are kept.
struct Places {
    alignas(16) std::uint8_t from[8][16];
    alignas(16) std::uint8_t kept[9][16];
    alignas(32) double sign[8][4]; // bit k of the number: whether number k has a minus
};
constexpr Places places_of() {
    Places out{};
    for (int whole = 0; whole < 8; ++whole)
        for (int at = 0; at < 16; ++at) {
            const int from = at < 8 ? at - (8 - whole) : at - 8 + whole + 1;
            out.from[whole][at] = from < 0 || from > 15 ? 0x80 : static_cast<std::uint8_t>(from);
        }
    for (int fraction = 0; fraction < 9; ++fraction)
        for (int at = 0; at < 16; ++at)
            out.kept[fraction][at] = at < 8 + fraction ? 0xff : 0;
    for (int signs = 0; signs < 8; ++signs)
        for (int k = 0; k < 3; ++k)
            out.sign[signs][k] = (signs >> k & 1) != 0 ? -0.0 : 0.0;
    return out;
}
constexpr Places places = places_of();

[[gnu::always_inline]] inline std::uint64_t load(const char *p) {
    std::uint64_t word = 0;
    std::memcpy(&word, p, 8);
    return word;
}

// The places of the next 57 bytes, or some more, that are no digits.
[[gnu::always_inline]] inline std::uint64_t breaks_at(const Lines &lines, const char *p) {
    const auto from = static_cast<std::size_t>(p - lines.marked);
    return load(reinterpret_cast<const char *>(lines.breaks) + from / 8) >> from % 8;
}

// Where the line at lines.p ends: at its LF, and before it at `last`. Null where it may not be read.
[[gnu::always_inline]] inline const char *line_end(Lines &lines, const char *&last) {
    while (lines.left == 0 && lines.word + 1 < lines.words)
        lines.left = lines.ends[++lines.word];
    const char *const stop = lines.marked + 64 * lines.word + _tzcnt_u64(lines.left);
    if (lines.left == 0 || stop >= lines.limit || lines.p >= lines.end)
        return nullptr;
    last = stop - (stop != lines.p && stop[-1] == '\r');
    return stop;
}

// Of every eight bytes with a digit's value each: what they are worth together.
[[gnu::always_inline]] inline __m256i worth(__m256i digits) {
    const __m256i pairs = _mm256_maddubs_epi16(digits, _mm256_set1_epi16(0x010a));
    const __m256i fours = _mm256_madd_epi16(pairs, _mm256_set1_epi32(0x00010064));
    const __m256i words = _mm256_packus_epi32(fours, fours);
    return _mm256_madd_epi16(words, _mm256_set1_epi32(0x00012710)); // two a lane, twice
}

// Behind blanks: the digits of one number, as `places` lays them, and whether it has a minus. What follows it
// is not looked at. False: not plain.
[[gnu::always_inline]] inline bool take_number(const Lines &lines, const char *&p, __m128i &shape,
                                               unsigned &minus) {
    if (*p != ' ')
        return false;
    do
        ++p;
    while (*p == ' ');
    minus = *p == '-';
    const std::uint64_t left = breaks_at(lines, p) >> minus;
    p += minus;
    const std::uint64_t whole = _tzcnt_u64(left), stop = _tzcnt_u64(_blsr_u64(left));
    const std::uint64_t fraction = stop - whole - 1;
    // 1 to 7 and 1 to 8 digits.
    if ((((whole - 1) | (fraction - 1) | (whole & 8)) >= 8) | (p[whole] != '.'))
        return false;
    const __m128i bytes =
        _mm_sub_epi8(_mm_loadu_si128(reinterpret_cast<const __m128i *>(p)), _mm_set1_epi8('0'));
    shape = _mm_and_si128(
        _mm_shuffle_epi8(bytes, _mm_load_si128(reinterpret_cast<const __m128i *>(places.from[whole]))),
        _mm_load_si128(reinterpret_cast<const __m128i *>(places.kept[fraction])));
    p += stop;
    return true;
}

template <typename Real, int count, char second>
std::size_t read_numbers(Lines &from, std::size_t most, Real *out) {
    constexpr int keyword = second == ' ' ? 1 : 2;
    Lines lines = from;
    std::size_t found = 0;
    for (; found < most; ++found) {
        const char *last = nullptr;
        const char *const stop = line_end(lines, last);
        const char *p = lines.p;
        if (!stop || p[0] != 'v' || p[1] != second)
            break;
        p += keyword;
        __m128i x{}, y{}, z{};
        unsigned signs[3] = {};
        if (!take_number(lines, p, x, signs[0]) || !take_number(lines, p, y, signs[1]))
            break;
        if constexpr (count == 3)
            if (!take_number(lines, p, z, signs[2]))
                break;
        while (*p == ' ')
            ++p;
        if (p != last)
            break;
        // Digits before the points and behind them, of x y z and nothing.
        const __m256i xy = worth(_mm256_inserti128_si256(_mm256_castsi128_si256(x), y, 1));
        const __m128i both = _mm_unpacklo_epi32(_mm256_castsi256_si128(xy), _mm256_extracti128_si256(xy, 1));
        __m128i whole = _mm_move_epi64(both), behind = _mm_srli_si128(both, 8);
        if constexpr (count == 3) {
            const __m128i other = _mm_move_epi64(_mm256_castsi256_si128(worth(_mm256_castsi128_si256(z))));
            whole = _mm_blend_epi32(whole, _mm_slli_si128(other, 8), 4);
            behind = _mm_blend_epi32(behind, _mm_slli_si128(other, 4), 4);
        }
        // Exact as doubles, as is their sum of at most 15 digits: the quotient is the double nearest to the
        // decimal. Where it lies halfway between two floats, read_number must decide.
        const __m256d sum = _mm256_add_pd(_mm256_mul_pd(_mm256_cvtepi32_pd(whole), _mm256_set1_pd(1e8)),
                                          _mm256_cvtepi32_pd(behind));
        const __m256d sign = _mm256_load_pd(places.sign[signs[0] | signs[1] << 1 | signs[2] << 2]);
        const __m256d value = _mm256_or_pd(_mm256_div_pd(sum, _mm256_set1_pd(1e8)), sign);
        const __m256i rest = _mm256_and_si256(_mm256_castpd_si256(value), _mm256_set1_epi64x(0x1fffffff));
        const __m256i halfway = _mm256_cmpeq_epi64(rest, _mm256_set1_epi64x(0x10000000));
        if (!_mm256_testz_si256(halfway, halfway))
            break;
        if constexpr (sizeof(Real) == sizeof(double))
            _mm256_storeu_pd(out, value);
        else if constexpr (count == 3)
            _mm_storeu_ps(out, _mm256_cvtpd_ps(value));
        else
            _mm_storel_pi(reinterpret_cast<__m64 *>(out), _mm256_cvtpd_ps(value));
        out += count;
        lines.left = _blsr_u64(lines.left);
        lines.p = stop + 1;
    }
    from = lines;
    return found;
}

// The three indices, from 0, of a corner v/vt/vn at p. False: not plain.
[[gnu::always_inline]] inline bool take_corner(const Lines &lines, const char *&p, __m128i &indices) {
    std::uint64_t left = breaks_at(lines, p);
    const std::uint64_t first = _tzcnt_u64(left);
    left = _blsr_u64(left);
    const std::uint64_t second = _tzcnt_u64(left);
    const std::uint64_t third = _tzcnt_u64(_blsr_u64(left));
    const std::uint64_t uv = second - first - 1, normal = third - second - 1;
    const bool plain = (((first - 1) | (uv - 1) | (normal - 1)) < 8) & (p[first] == '/') & (p[second] == '/');
    if (!plain)
        return false;
    const auto word = [&](std::uint64_t at, std::uint64_t digits) {
        return static_cast<long long>(load(p + at) << ((64 - 8 * digits) & 63) & 0x0f0f0f0f0f0f0f0full);
    };
    const __m128i low = _mm_insert_epi64(_mm_cvtsi64_si128(word(0, first)), word(first + 1, uv), 1);
    const __m128i high = _mm_cvtsi64_si128(word(second + 1, normal));
    const __m256i all = worth(_mm256_inserti128_si256(_mm256_castsi128_si256(low), high, 1));
    indices = _mm_sub_epi32(_mm_unpacklo_epi64(_mm256_castsi256_si128(all), _mm256_extracti128_si256(all, 1)),
                            _mm_set1_epi32(1));
    p += third;
    return true;
}

std::size_t read_faces(Lines &from, std::size_t most, const std::uint32_t have[3], std::uint64_t line,
                       Corner *&corners, Face *faces) {
    Lines lines = from;
    // An index is below what there is where the lesser of it and the last one is itself. (0 less 1 is the
    // largest; where there are none, the last one is too, and no line is taken.)
    if (have[0] == 0 || have[1] == 0 || have[2] == 0)
        return 0;
    const __m128i last_ones = _mm_setr_epi32(static_cast<int>(have[0] - 1), static_cast<int>(have[1] - 1),
                                             static_cast<int>(have[2] - 1), -1);
    Corner *next = corners;
    std::size_t found = 0;
    for (; found < most; ++found) {
        const char *last = nullptr;
        const char *const stop = line_end(lines, last);
        const char *p = lines.p;
        if (!stop || p[0] != 'f' || p[1] != ' ')
            break;
        ++p;
        Corner *corner = next;
        __m128i sound = _mm_set1_epi32(-1);
        while (*p == ' ') {
            do
                ++p;
            while (*p == ' ');
            __m128i indices{};
            if (!take_corner(lines, p, indices))
                break;
            sound = _mm_and_si128(sound, _mm_cmpeq_epi32(_mm_min_epu32(indices, last_ones), indices));
            _mm_storeu_si128(reinterpret_cast<__m128i *>(corner++), indices);
        }
        if (p != last || corner - next < 3 || _mm_movemask_epi8(sound) != 0xffff)
            break;
        *faces++ = {static_cast<std::uint32_t>(corner - next), static_cast<std::uint32_t>(line++)};
        next = corner;
        lines.left = _blsr_u64(lines.left);
        lines.p = stop + 1;
    }
    corners = next;
    from = lines;
    return found;
}

constexpr LineReaders readers{read_numbers<double, 3, ' '>, read_numbers<float, 2, 't'>,
                              read_numbers<float, 3, 'n'>, read_faces};

} // namespace
} // namespace paradize::obj
#pragma GCC pop_options
#endif

namespace paradize::obj {

const LineReaders *wide_readers() {
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2"))
        return &readers;
#endif
    return nullptr;
}

} // namespace paradize::obj
