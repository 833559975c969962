#include "bcn/encode.hpp"

#include "bcn/widths.hpp"
#include "parallel.hpp"

namespace paradize::bcn {

namespace {

struct Rows {
    decltype(&baseline::color_row) color = &baseline::color_row;
    decltype(&baseline::value_row) value = &baseline::value_row;
};

// The widest that this CPU runs; all give the same bits.
Rows widest() {
#ifdef PARADIZE_WIDE
    if (has_avx512()) {
        return {&avx512::color_row, &avx512::value_row};
    }
    if (has_avx2()) {
        return {&avx2::color_row, &avx2::value_row};
    }
#endif
    return {};
}

// Every row of blocks once, shared out to threads.
template <typename Row>
void over_rows(const Texels &texels, std::size_t block_bytes, std::span<std::uint8_t> out, int threads,
               Row &&encode) {
    const std::size_t row_bytes = (texels.columns + 3) / 4 * block_bytes;
    for_rows((texels.rows + 3) / 4, threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t row = first; row < last; ++row) {
            encode(row, out.data() + row * row_bytes);
        }
    });
}

void encode_colors(const Texels &texels, bool with_alpha, Quality quality, std::span<std::uint8_t> out,
                   int threads) {
    const auto run = widest().color;
    over_rows(texels, with_alpha ? 16 : 8, out, threads,
              [&](std::size_t row, std::uint8_t *to) { run(texels, row, with_alpha, quality, to); });
}

} // namespace

void encode_bc1(const Texels &texels, Quality quality, std::span<std::uint8_t> out, int threads) {
    encode_colors(texels, false, quality, out, threads);
}

void encode_bc3(const Texels &texels, Quality quality, std::span<std::uint8_t> out, int threads) {
    encode_colors(texels, true, quality, out, threads);
}

void encode_values(const Texels &texels, bool is_signed, Quality quality, std::span<std::uint8_t> out,
                   int threads) {
    const auto run = widest().value;
    over_rows(texels, 8 * texels.channels, out, threads,
              [&](std::size_t row, std::uint8_t *to) { run(texels, row, is_signed, quality, to); });
}

} // namespace paradize::bcn
