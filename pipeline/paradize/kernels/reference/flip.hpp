// FLIP, the visible difference of two pictures that alternate in one place, without libm: the same bits on
// every machine. For metrics only. Source: P. Andersson, J. Nilsson, T. Akenine-Moeller, M. Oskarsson, K.
// Astroem, M. D. Fairchild, "FLIP: A Difference Evaluator for Alternating Images", 2020.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace paradize::reference {

// a, b: (rows, columns, 3) codes of sRGB. Returns (rows, columns) errors, 0..1, seen from 0.7 m on a display
// of 3840 pixels and 0.7 m across. Beyond its edges a picture goes on as at them.
std::vector<float> flip(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b, std::size_t rows,
                        std::size_t columns);

// Pixels beyond which a difference has no effect.
inline constexpr std::size_t flip_reach = 13;

} // namespace paradize::reference
