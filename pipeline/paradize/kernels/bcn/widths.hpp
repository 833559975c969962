// Rows of blocks by each instruction set (bcn_rows_*.cpp).
#pragma once

#include "bcn/encode.hpp"
#include "simd/cpu.hpp"

namespace paradize::bcn {

#define PARADIZE_ROWS(width)                                                                                 \
    namespace width {                                                                                        \
    void color_row(const Texels &from, std::size_t row, bool with_alpha, Quality quality,                    \
                   std::uint8_t *out);                                                                       \
    void value_row(const Texels &from, std::size_t row, bool is_signed, Quality quality, std::uint8_t *out); \
    }
PARADIZE_EACH_WIDTH(PARADIZE_ROWS)
#undef PARADIZE_ROWS

} // namespace paradize::bcn
