// Measures how far samples along the borders of UV islands see their neighbours, level by level.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace paradize::gutter {

// How two samples are compared; every error is a share of the range, 0 to 1.
//   value: the largest difference of any channel
//   color: linear light in, compared by square roots (near to the sRGB curve), the largest of red, green and
//          blue; with a fourth channel, alpha, times the island's own alpha: what is not seen does not bleed
//   normal: x and y in, z is rebuilt; half the chord between the two unit vectors (1: opposite)
enum class Kind { value, color, normal };

// The first levels of a mip chain: level 0 first, of rows x columns texels, each half the size of the one
// before (rounded down, at least 1), row 0 at the top, `channels` floats a texel, 1 to 4.
struct Chain {
    std::span<const float *const> levels;
    std::size_t rows;
    std::size_t columns;
    std::size_t channels;
};

// Level 0's texels, rows * columns each.
//   inside: 1 where a triangle touches the texel
//   source: the index of the nearest inside texel (itself where inside)
//   owner: the island of that texel, >= 0
// repeat: whether samples beyond the edge come from the other side (else from the edge).
struct Layout {
    std::span<const std::uint8_t> inside;
    std::span<const std::int32_t> source;
    std::span<const std::int32_t> owner;
    bool repeat;
};

// The findings at one level. `worst` of any sample, at level-0 texel (x, y), `p99` and `mean` of the island
// that fares worst by its 99th percentile, `all_p99` of all samples. own: how much of the worst sample is its
// own island's.
struct LevelBleed {
    double mean = 0.0;
    double p99 = 0.0;
    double all_p99 = 0.0;
    double worst = 0.0;
    std::int64_t x = -1;
    std::int64_t y = -1;
    std::int64_t island = -1;
    std::int64_t samples = 0;
    double own = 1.0;
};

// Islands between which no whole texel lies, as one: ids (rows * columns; -1 outside) -> a name for each of
// `count` ids. Names are dense, in order of the smallest id.
std::vector<std::int32_t> touching(std::span<const std::int32_t> ids, std::size_t rows, std::size_t columns,
                                   std::size_t count, bool repeat);

// The smallest distance, in texels, between texels of two different islands' borders, less one: how many
// texels lie between them. Along each border of the nearest-texel diagram the two sources are compared.
// -1 where there is one island only. pair: level-0 indices of the two texels.
double smallest_gap(const Layout &layout, std::size_t rows, std::size_t columns,
                    std::span<std::int64_t, 2> pair);

// The texels of the islands' borders: inside, with a neighbour that is outside or another island's. By
// island, in the order of rows within each.
std::vector<std::uint32_t> border_of(const Layout &layout, std::size_t rows, std::size_t columns);

// Walks every island's border at every level of the chain: from each of its outermost texels, samples at the
// texel's corners and edges, half a pixel and `reach` (by island; a share of the map's sides) beyond, in
// eight directions, filtered bilinearly, against the same sample without foreign texels. What a level should
// hold of each island is the area mean of the island's own texels of level 0, its gutter included, the gutter
// being its nearest texel. Texels that lie wholly inside are taken as they are, so that compression alone is
// no bleeding. An island of negative reach is not walked. border: as border_of finds it.
std::vector<LevelBleed> walk(const Chain &chain, Kind kind, const Layout &layout,
                             std::span<const std::uint32_t> border, std::span<const double> reach,
                             int threads);

} // namespace paradize::gutter
