// Standard headers come before the pragma, so that nothing shared is compiled for wider CPUs.
#include "normals/light.hpp"

#include <bit>

#include "simd/cpu.hpp"

namespace paradize::normals {

SharePlanes planes_of(const Shares &shares) {
    SharePlanes out;
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t code = 0; code < 256; ++code) {
            const auto bits = std::bit_cast<std::uint32_t>(shares[c][code]);
            for (std::size_t b = 0; b < 4; ++b) {
                out.planes[c][b][code] = static_cast<std::uint8_t>(bits >> (8 * b));
            }
        }
    }
    return out;
}

} // namespace paradize::normals

#ifdef PARADIZE_WIDE
#include <immintrin.h>

namespace paradize::normals {

bool has_byte_lookup() {
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512vbmi");
}

#pragma GCC push_options
#pragma GCC target("avx512f,avx512bw,avx512vbmi")
namespace {

// Where the bytes of 64 texels come from, in the order in which unpacking lays their floats side by side.
struct Places {
    alignas(64) std::uint8_t near[3][64]; // out of bytes 0 .. 127
    alignas(64) std::uint8_t far[3][64];  // out of that, or out of bytes 128 and above
};

Places places_of(std::size_t channels) {
    Places out;
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t p = 0; p < 64; ++p) {
            const std::size_t texel = 16 * (p % 16 / 4) + 4 * (p / 16) + p % 4;
            const std::size_t at = channels * texel + c;
            out.near[c][p] = static_cast<std::uint8_t>(at % 128);
            out.far[c][p] = static_cast<std::uint8_t>(at < 128 ? p : 64 + at % 64);
        }
    }
    return out;
}

// Four bytes of table for each of 64 codes, unpacked to 64 floats and added to the sums.
inline void add_shares(const std::uint8_t (&planes)[4][256], __m512i codes, __m512 (&sums)[4], bool first) {
    const __mmask64 upper = _mm512_movepi8_mask(codes);
    __m512i bytes[4];
    for (int b = 0; b < 4; ++b) {
        const std::uint8_t *table = planes[b];
        const __m512i low =
            _mm512_permutex2var_epi8(_mm512_load_si512(table), codes, _mm512_load_si512(table + 64));
        const __m512i high =
            _mm512_permutex2var_epi8(_mm512_load_si512(table + 128), codes, _mm512_load_si512(table + 192));
        bytes[b] = _mm512_mask_blend_epi8(upper, low, high);
    }
    const __m512i low01 = _mm512_unpacklo_epi8(bytes[0], bytes[1]);
    const __m512i high01 = _mm512_unpackhi_epi8(bytes[0], bytes[1]);
    const __m512i low23 = _mm512_unpacklo_epi8(bytes[2], bytes[3]);
    const __m512i high23 = _mm512_unpackhi_epi8(bytes[2], bytes[3]);
    const __m512 values[4] = {
        _mm512_castsi512_ps(_mm512_unpacklo_epi16(low01, low23)),
        _mm512_castsi512_ps(_mm512_unpackhi_epi16(low01, low23)),
        _mm512_castsi512_ps(_mm512_unpacklo_epi16(high01, high23)),
        _mm512_castsi512_ps(_mm512_unpackhi_epi16(high01, high23)),
    };
    for (int i = 0; i < 4; ++i) {
        sums[i] = first ? values[i] : _mm512_add_ps(sums[i], values[i]);
    }
}

} // namespace

std::size_t light_of_bytes(const std::uint8_t *texels, std::size_t n, std::size_t channels,
                           const SharePlanes &shares, float *to) {
    static const Places three = places_of(3);
    static const Places four = places_of(4);
    const Places &places = channels == 3 ? three : four;
    std::size_t x = 0;
    for (; x + 64 <= n; x += 64, texels += 64 * channels) {
        __m512i part[4];
        for (std::size_t i = 0; i < 4; ++i) {
            // Two pages ahead: the hardware looks no further than the end of one.
            __builtin_prefetch(
                reinterpret_cast<const void *>(reinterpret_cast<std::uintptr_t>(texels) + 64 * i + 8192));
            part[i] = _mm512_loadu_si512(texels + 64 * (i < channels ? i : 0));
        }
        __m512 sums[4] = {};
        for (std::size_t c = 0; c < 3; ++c) {
            const __m512i near = _mm512_load_si512(places.near[c]);
            const __m512i far = _mm512_load_si512(places.far[c]);
            __m512i codes = _mm512_permutex2var_epi8(part[0], near, part[1]);
            if (channels == 3) {
                codes = _mm512_permutex2var_epi8(codes, far, part[2]);
            } else {
                const __m512i beyond = _mm512_permutex2var_epi8(part[2], near, part[3]);
                // Texels 32 and above are those at an odd eight of every sixteen places.
                codes = _mm512_mask_blend_epi8(0xff00ff00ff00ff00ULL, codes, beyond);
            }
            add_shares(shares.planes[c], codes, sums, c == 0);
        }
        for (std::size_t i = 0; i < 4; ++i) {
            _mm512_storeu_ps(to + x + 16 * i, sums[i]);
        }
    }
    return x;
}
#pragma GCC pop_options

} // namespace paradize::normals

#else

namespace paradize::normals {

bool has_byte_lookup() {
    return false;
}

std::size_t light_of_bytes(const std::uint8_t *, std::size_t, std::size_t, const SharePlanes &, float *) {
    return 0;
}

} // namespace paradize::normals

#endif
