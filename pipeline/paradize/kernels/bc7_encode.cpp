#include "bc7_encode.hpp"

#include <memory>

#include "bc7_effort.hpp"
#include "bc7_picture.hpp"
#include "maps_parallel.hpp"

namespace paradize::bc7 {

// The same rows compiled for several instruction sets (bc7_rows_*.cpp).
#define PARADIZE_ROWS(width)                                                                                 \
    namespace width {                                                                                        \
    void encode_row(const Picture &picture, std::size_t row, const Effort &effort, Scratch &scratch,         \
                    std::uint8_t *out);                                                                      \
    }

PARADIZE_ROWS(baseline)
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define PARADIZE_WIDE 1
PARADIZE_ROWS(avx2)
PARADIZE_ROWS(avx512)
#endif
#undef PARADIZE_ROWS

namespace {

// The widest that this CPU runs; all give the same bits.
decltype(&baseline::encode_row) widest() {
#ifdef PARADIZE_WIDE
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw")) {
        return &avx512::encode_row;
    }
    if (__builtin_cpu_supports("avx2")) {
        return &avx2::encode_row;
    }
#endif
    return &baseline::encode_row;
}

} // namespace

void encode(std::span<const std::uint8_t> rgba, std::size_t rows, std::size_t columns, Quality quality,
            std::span<std::uint8_t> out, int threads) {
    const auto run = widest();
    const Picture picture{rgba.data(), rows, columns};
    const std::size_t across = picture.across();
    const Effort &effort = efforts[static_cast<std::size_t>(quality)];
    maps::for_rows(picture.down(), threads, [&](std::size_t first, std::size_t last) {
        const auto scratch = std::make_unique<Scratch>();
        for (std::size_t row = first; row < last; ++row) {
            run(picture, row, effort, *scratch, &out[row * across * 16]);
        }
    });
}

} // namespace paradize::bc7
