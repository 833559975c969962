#include "bc7/encode.hpp"

#include <memory>

#include "bc7/widths.hpp"
#include "parallel.hpp"

namespace paradize::bc7 {

namespace {

// The widest that this CPU runs; all give the same bits.
decltype(&baseline::encode_row) widest() {
#ifdef PARADIZE_WIDE
    if (has_avx512()) {
        return &avx512::encode_row;
    }
    if (has_avx2()) {
        return &avx2::encode_row;
    }
#endif
    return &baseline::encode_row;
}

} // namespace

void encode(std::span<const std::uint8_t> rgba, std::size_t rows, std::size_t columns, Quality quality,
            float alpha_weight, std::span<std::uint8_t> out, int threads) {
    const auto run = widest();
    const Picture picture{rgba.data(), rows, columns};
    const std::size_t across = picture.across();
    for_rows(picture.down(), threads, [&](std::size_t first, std::size_t last) {
        const auto scratch = std::make_unique<Scratch>();
        for (std::size_t row = first; row < last; ++row) {
            run(picture, row, quality, alpha_weight, *scratch, &out[row * across * 16]);
        }
    });
}

} // namespace paradize::bc7
