// The error of every mip level of a baked map against float64 area means of level 0's truth. For metrics
// only.
//
// Results do not depend on the number of threads: sums are taken row by row in the order of rows, percentiles
// are exact. Memory: some rows per thread and level, and two of a hundred of a level's errors.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "reference/maps/height_map.hpp"
#include "reference/maps/tally.hpp"
#include "reference/maps/texels.hpp"

namespace paradize::reference {

struct TextureView {
    Texels format;
    std::size_t channels; // of the plain formats
    Size size;
    std::vector<std::span<const std::uint8_t>> levels; // level 0 first, each level_bytes long
};

// Angles in degrees between the normals that a shader rebuilds from the texture's first two channels and the
// normals of the height map, averaged and normalised. Texels near borders of islands are left out. Where the
// height map has cones, an angle counts as far as it exceeds the mean of a texel's cones.
std::vector<LevelError> normal_levels(const TextureView &texture, const HeightMap &height_map, int threads);

// The same of du/dv: x and y of the height map's normals less their mean over the map (over the islands).
std::vector<LevelError> offset_levels(const TextureView &texture, const HeightMap &height_map, int threads);

// Angles between the normals of one height map by two filters, less the other's cones: of level 0 alone.
LevelError filter_angles(const HeightMap &height_map, const HeightMap &other, int threads);

// The angles, degrees, that the half steps of a height map with cones leave open around its normals.
LevelError open_angles(const HeightMap &height_map, int threads);

// Squared and absolute differences from values (rows, columns, channels).
std::vector<LevelError> value_levels(const TextureView &texture, std::span<const float> values,
                                     std::size_t channels, int threads);

// The same of gloss (rows, columns, 2): channel 0 averaged; channel 1, smoothness s of roughness
// alpha = (1 - s)^2, by averaging alpha^2 and adding 2 (1 - r^2) / (r (3 - r^2)), r the length of the
// averaged normal, up to 1. Source: D. Neubelt and M. Pettineo, "Crafting a next-gen material pipeline for
// The Order: 1886", 2013. Where the height map has cones, r may be longer or shorter by their mean.
std::vector<LevelError> gloss_levels(const TextureView &texture, std::span<const float> gloss,
                                     const HeightMap &height_map, int threads);

// Angles, degrees, by which gloss makes highlights too wide or too narrow: from the normal, where the
// distribution of slopes of GGX with the truth's roughness (as above) and with the texture's falls to a half:
// tan^2 = (sqrt(2) - 1) alpha^2, so at most 32.8. Source of GGX: B. Walter et al., "Microfacet Models for
// Refraction through Rough Surfaces", 2007.
std::vector<LevelError> highlight_levels(const TextureView &texture, std::span<const float> gloss,
                                         const HeightMap &height_map, int threads);

struct Pixels {
    enum class Kind { u8, u16, f32 };
    Kind kind;
    const void *data; // (rows, columns, channels): 3, or 4 with alpha last; integers stand for 0..1
    std::size_t channels;
    bool encoded; // by the sRGB curve; else linear light. Values beyond 0..1 count as clipped.
};

// Squared and absolute differences of colour in sRGB-encoded values. Truth: linear light averaged, weighted
// by alpha (by area alone where all is transparent). Alpha: averaged; with a cutoff above 0, from level 1 on
// by a factor in 1/16..16 that keeps level 0's share of texels at or above it, up to 1. Source of that: I.
// Castano, "Computing alpha mipmaps", 2010.
std::vector<LevelError> color_levels(const TextureView &texture, const Pixels &pixels, double cutoff,
                                     int threads);

} // namespace paradize::reference
