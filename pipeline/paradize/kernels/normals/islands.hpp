// Slopes of texels near the border of their UV island.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "normals/lines.hpp"
#include "normals/sweep.hpp"

namespace paradize::normals {

// Redoes the texels of a row whose taps leave their island; those outside all islands are left as they are.
// One per thread; see normals_from_heights.
class IslandRows {
  public:
    static constexpr std::size_t run = 8; // texels that are worked on at once

    // Two opposite taps of a row's first texel, and their weight.
    struct Pair {
        const std::int32_t *after_ids;
        const float *after_heights;
        const std::int32_t *before_ids;
        const float *before_heights;
        double weight;
    };

    IslandRows(std::span<const float> heights, std::span<const std::int32_t> islands, std::size_t rows,
               std::size_t columns, const Settings &settings);

    // Writes over the normals (x y z) of row y that have such taps.
    void patch(std::size_t y, float *xyz);

  private:
    // A row, extended by the depth on both sides.
    struct IdLine {
        std::vector<std::int32_t> ids;          // beyond the map's ends those of the reflection
        std::vector<std::int32_t> on_map;       // beyond the map's ends `nowhere`
        std::vector<float> heights;             // 0 there
        std::vector<std::uint8_t> along_breaks; // whether an id within `reach` columns differs
        std::vector<std::uint8_t> cross_breaks; // whether an id within `across` columns differs
        std::ptrdiff_t held;
    };

    const IdLine &line(std::ptrdiff_t y);
    void mark(std::size_t y);
    template <bool down>
    void pair_up(std::vector<Pair> &pairs) const;

    std::span<const float> heights_;
    std::span<const std::int32_t> islands_;
    std::size_t rows_;
    std::size_t columns_;
    Settings settings_;
    std::size_t depth_;
    std::vector<IdLine> lines_;
    std::vector<std::uint8_t> marked_;
    std::vector<Pair> along_; // of that row
    std::vector<Pair> down_;
    std::vector<const IdLine *> around_; // of the row that is patched: the 2 * depth + 1 rows about it
};

} // namespace paradize::normals
