#include "bcn_encode.hpp"

#include "bcn_solid.hpp"
#include "maps_parallel.hpp"

namespace paradize::bcn {

// The same rows compiled for several instruction sets (bcn_rows_*.cpp).
#define PARADIZE_ROWS(width)                                                                                 \
    namespace width {                                                                                        \
    void color_row(const std::uint8_t *rgba, std::size_t row, std::size_t rows, std::size_t columns,         \
                   bool with_alpha, int passes, const SolidTables &solid, std::uint8_t *out);                \
    void single_row(const float *values, std::size_t channels, std::size_t row, std::size_t rows,            \
                    std::size_t columns, bool is_signed, int passes, std::uint8_t *out);                     \
    }

PARADIZE_ROWS(baseline)
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define PARADIZE_WIDE 1
PARADIZE_ROWS(avx2)
PARADIZE_ROWS(avx512)
#endif
#undef PARADIZE_ROWS

namespace {

struct Rows {
    decltype(&baseline::color_row) color = &baseline::color_row;
    decltype(&baseline::single_row) single = &baseline::single_row;
};

// The widest that this CPU runs; all give the same bits.
Rows widest() {
#ifdef PARADIZE_WIDE
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw")) {
        return {&avx512::color_row, &avx512::single_row};
    }
    if (__builtin_cpu_supports("avx2")) {
        return {&avx2::color_row, &avx2::single_row};
    }
#endif
    return {};
}

void encode_colors(std::span<const std::uint8_t> rgba, std::size_t rows, std::size_t columns, bool with_alpha,
                   int passes, std::span<std::uint8_t> out, int threads) {
    static const SolidTables solid;
    const Rows run = widest();
    const std::size_t row_bytes = ((columns + 3) / 4) * (with_alpha ? 16 : 8);
    maps::for_rows((rows + 3) / 4, threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t row = first; row < last; ++row) {
            run.color(rgba.data(), row, rows, columns, with_alpha, passes, solid, &out[row * row_bytes]);
        }
    });
}

void encode_singles(std::span<const float> values, std::size_t channels, std::size_t rows,
                    std::size_t columns, bool is_signed, int passes, std::span<std::uint8_t> out,
                    int threads) {
    const Rows run = widest();
    const std::size_t row_bytes = ((columns + 3) / 4) * 8 * channels;
    maps::for_rows((rows + 3) / 4, threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t row = first; row < last; ++row) {
            run.single(values.data(), channels, row, rows, columns, is_signed, passes, &out[row * row_bytes]);
        }
    });
}

} // namespace

void encode_bc1(std::span<const std::uint8_t> rgba, std::size_t rows, std::size_t columns, int passes,
                std::span<std::uint8_t> out, int threads) {
    encode_colors(rgba, rows, columns, false, passes, out, threads);
}

void encode_bc3(std::span<const std::uint8_t> rgba, std::size_t rows, std::size_t columns, int passes,
                std::span<std::uint8_t> out, int threads) {
    encode_colors(rgba, rows, columns, true, passes, out, threads);
}

void encode_bc4(std::span<const float> values, std::size_t rows, std::size_t columns, bool is_signed,
                int passes, std::span<std::uint8_t> out, int threads) {
    encode_singles(values, 1, rows, columns, is_signed, passes, out, threads);
}

void encode_bc5(std::span<const float> values, std::size_t rows, std::size_t columns, bool is_signed,
                int passes, std::span<std::uint8_t> out, int threads) {
    encode_singles(values, 2, rows, columns, is_signed, passes, out, threads);
}

} // namespace paradize::bcn
