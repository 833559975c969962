// Directions of the rays: cosine-weighted about +z, from one low-discrepancy sequence, without chance.
// Source: I. M. Sobol, "On the distribution of points in a cube and the approximate evaluation of integrals",
// 1967; the disk is P. Shirley's "Nusselt" mapping of a square by polar coordinates.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace paradize::occlusion {

// Each texel of a block of 8 x 8 has its own stretch of the sequence. Stretches of a power of two are spread
// evenly by themselves, and so are those of 2 x 2, 4 x 4 and 8 x 8 texels together: what is left of error is
// grain that the mips average, not bands.
constexpr std::size_t block_side = 8, sets = block_side * block_side;
constexpr std::size_t packet = 16; // rays of a set that lie beside each other; they point alike

struct Directions {
    std::size_t rays;           // of a set: a power of two, at least `packet`
    std::vector<float> x, y, z; // (sets, rays), unit
};

Directions make_directions(std::size_t rays);

// The set of the texel in a row and column.
std::size_t set_of(std::size_t row, std::size_t column);

} // namespace paradize::occlusion
