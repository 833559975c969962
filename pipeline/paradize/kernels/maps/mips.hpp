// Half-size images: each texel is the mean of the area that it covers, odd sizes included.
// Source of the weights for odd sizes: S. Guthe and P. Heckbert, "Non-power-of-two mipmapping", NVIDIA, 2005.
#pragma once

#include <cstddef>
#include <span>

namespace paradize::maps {

// The next level's size: half, rounded down, at least 1.
constexpr std::size_t half_size(std::size_t size) {
    return size > 1 ? size / 2 : 1;
}

// Which rows of the next level are made: `count` of them from `first` on, of an image of `rows` rows in all.
struct HalfRows {
    std::size_t rows;
    std::size_t first;
    std::size_t count;
};

// How many rows of the image, from row 2 * first on, those of the next level are made of.
constexpr std::size_t rows_below(const HalfRows &half) {
    return half.rows == 1 ? 1 : 2 * half.count + half.rows % 2;
}

// in: rows_below(half) * columns * channels floats. out: half.count * half_size(columns) * channels, area
// means. An area never passes an edge, so a periodic map stays periodic.
void halve(std::span<const float> in, const HalfRows &half, std::size_t columns, std::size_t channels,
           std::span<float> out, int threads);

// The same for colour with alpha in the last of 2 or 4 channels: colour is weighted by alpha (by area alone
// where all of it is transparent), alpha by area.
void halve_with_alpha(std::span<const float> in, const HalfRows &half, std::size_t columns,
                      std::size_t channels, std::span<float> out, int threads);

// in: n * 3 vectors. out: the same with length 1; a sum of zero becomes (0, 0, 1).
void normalise(std::span<const float> in, std::span<float> out, int threads);

// The factor for alpha that keeps `fraction` of the texels at or above `cutoff`, within [1/16, 16]; 1 where
// no factor does. Source: I. Castano, "Computing alpha mipmaps", 2010.
double coverage_factor(std::span<const float> alpha, double fraction, double cutoff);

// Squared roughness alpha^2 of smoothness s, alpha = (1 - s)^2: what averages linearly, being twice the
// variance of slopes.
void smoothness_to_variance(std::span<const float> smoothness, std::span<float> variance, int threads);

// Back, widened by what averaging took from the normals' length r = |n|: alpha^2 + 2 (1 - r^2) / (r (3 -
// r^2)), at most 1. averages: n * 3 means of unit normals, not normalised. Source: D. Neubelt and M.
// Pettineo, "Crafting a next-gen material pipeline for The Order: 1886", 2013 (von Mises-Fisher).
void widened_smoothness(std::span<const float> variance, std::span<const float> averages,
                        std::span<float> smoothness, int threads);

} // namespace paradize::maps
