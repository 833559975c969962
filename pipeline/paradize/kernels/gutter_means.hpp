// What each texel of a level should hold of each island: means over the island's own texels of level 0.
#pragma once

#include "gutter_walk.hpp"

#include <array>

namespace paradize::gutter {

class Means {
  public:
    // Level 0: inside texels as they are, the gutter as its nearest inside texel.
    Means(const Chain &chain, Kind kind, const Layout &layout);

    // The next level: each texel gathers the texels of this one that its area covers.
    Means halved() const;

    // The share of `texel` that belongs to `island`, and in `mean` what the island alone has there (in the
    // chain's channels). Where the texel lies wholly inside the island, `value`, what the level holds.
    double own(std::size_t texel, std::int32_t island, const float *value, std::size_t channels,
               std::array<float, 4> &mean) const;

  private:
    // An island's part of a texel: its share of the area, and the sums of its values by area. Colour with
    // alpha is held multiplied by it; normals as x, y, z.
    struct Part {
        std::int32_t island = -1;
        float share = 0.0F;
        std::array<float, 4> sum{};
    };

    Means(std::size_t rows, std::size_t columns, std::size_t channels, Kind kind)
        : rows_(rows), columns_(columns), channels_(channels), kind_(kind) {}

    std::span<const Part> parts(std::size_t texel) const {
        return {parts_.data() + first_[texel], parts_.data() + first_[texel + 1]};
    }

    std::size_t rows_;
    std::size_t columns_;
    std::size_t channels_; // of the chain
    Kind kind_;
    std::vector<std::uint32_t> first_; // of each texel among the parts; one more at the end
    std::vector<Part> parts_;          // of each texel, by island
    std::vector<std::uint8_t> whole_;  // the texel lies wholly inside one island
};

} // namespace paradize::gutter
