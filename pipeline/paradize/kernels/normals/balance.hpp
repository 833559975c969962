// Which shift makes the codes of du/dv sum to exactly zero.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "normals/types.hpp"

namespace paradize::normals {

// What the first sweep knows of the fine codes f of a map.
struct FineCounts {
    FineSums sums;
    // Of each row, for x and then y: how many texels have (f & 255) >= level_step k.
    std::vector<std::uint32_t> levels;
};

// code = (f + shift) >> 8, and one more for the first more[row] texels of each row, from the left, whose
// shifted-out byte is of the highest level. These are spread over the rows by how many such texels each has.
struct Shift {
    std::int32_t by = 0;
    std::vector<std::uint32_t> more;
    bool cut_off = false; // a code would leave -127..127; `more` is empty then
};

// The shift of channel c (0 or 1) for rows of `columns` texels: the sum of all codes is exactly zero.
Shift balance(const FineCounts &counts, std::size_t columns, std::size_t channel);

// The same for maps whose codes have to be cut off: works on the codes themselves. normal and dudv as
// Encoding::fine left them; dudv's channel c becomes the codes.
void balance_cut_off(const std::uint8_t *normal, std::uint8_t *dudv, std::size_t texels, std::size_t channel);

} // namespace paradize::normals
