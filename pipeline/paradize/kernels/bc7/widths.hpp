// A row of BC7 blocks by each instruction set (bc7_rows_*.cpp).
#pragma once

#include <cstddef>
#include <cstdint>

#include "bc7/effort.hpp"
#include "bc7/picture.hpp"
#include "simd/cpu.hpp"

namespace paradize::bc7 {

#define PARADIZE_ROWS(width)                                                                                 \
    namespace width {                                                                                        \
    void encode_row(const Picture &picture, std::size_t row, Quality quality, float alpha_weight,            \
                    Scratch &scratch, std::uint8_t *out);                                                    \
    }
PARADIZE_EACH_WIDTH(PARADIZE_ROWS)
#undef PARADIZE_ROWS

} // namespace paradize::bc7
