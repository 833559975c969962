// The reference of a gutter: the value of each island in each texel of a level, as the mean of the island's
// own texels of level 0.
#pragma once

#include "gutter/walk.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace paradize::gutter {

// Added to alpha where colours are weighted by it, so that what is wholly transparent still has a colour.
constexpr float least_alpha = 1e-4F;

// The number of channels is known where this is compiled: the loops are short.
template <std::size_t channels>
constexpr bool has_alpha(Kind kind) {
    return channels == 4 && kind == Kind::color;
}
template <std::size_t channels>
constexpr std::size_t colors(Kind kind) {
    return has_alpha<channels>(kind) ? 3 : channels;
}

// An island's part of a texel: its share of the area, and the sums of its values by area. Colour with alpha
// is held multiplied by it; normals as x, y, z.
struct Part {
    std::int32_t island = -1;
    float share = 0.0F;
    std::array<float, 4> sum{};

    // The part in a cell that covers `area` of itself by this one.
    Part of(float area) const {
        return {island, share * area, {sum[0] * area, sum[1] * area, sum[2] * area, sum[3] * area}};
    }

    void add(const Part &other) {
        share += other.share;
        for (std::size_t c = 0; c < sum.size(); ++c) {
            sum[c] += other.sum[c];
        }
    }
};

// The mean that a part holds, in the chain's channels.
template <std::size_t channels>
std::array<float, 4> mean_of(Kind kind, const Part &part) {
    std::array<float, 4> mean{};
    float divisor = part.share;
    if (has_alpha<channels>(kind)) {
        mean[3] = part.sum[3] / part.share - least_alpha;
        divisor = part.sum[3];
    } else if (kind == Kind::normal) {
        divisor =
            std::sqrt(part.sum[0] * part.sum[0] + part.sum[1] * part.sum[1] + part.sum[2] * part.sum[2]);
    }
    for (std::size_t c = 0; c < colors<channels>(kind); ++c) {
        mean[c] = divisor > 0.0F ? part.sum[c] / divisor : 0.0F;
    }
    return mean;
}

// Level 0: inside texels as they are, the gutter as its nearest inside texel. Each texel is one island's.
template <std::size_t channels>
class Finest {
  public:
    Finest(const Chain &chain, Kind kind, const Layout &layout)
        : rows(chain.rows), columns(chain.columns), kind_(kind), texels_(chain.levels[0]), layout_(layout) {}

    bool whole(std::size_t texel) const { return layout_.inside[texel] != 0; }
    bool single(std::size_t) const { return true; }
    std::int32_t island(std::size_t texel) const { return layout_.owner[texel]; }
    std::array<Part, 1> parts(std::size_t texel) const { return {first(texel)}; }

    Part first(std::size_t texel) const {
        const float *value = texels_ + static_cast<std::size_t>(layout_.source[texel]) * channels;
        Part part{layout_.owner[texel], 1.0F, {}};
        std::copy_n(value, channels, part.sum.begin());
        if (has_alpha<channels>(kind_)) {
            part.sum[3] += least_alpha;
            for (std::size_t c = 0; c < 3; ++c) {
                part.sum[c] *= part.sum[3];
            }
        } else if (kind_ == Kind::normal) {
            part.sum[2] = std::sqrt(std::max(0.0F, 1.0F - value[0] * value[0] - value[1] * value[1]));
        }
        return part;
    }

    // The share of `texel` that belongs to `island`, and in `mean` what the island alone has there. Where the
    // texel lies wholly inside the island, `value`, what the level holds.
    template <std::size_t>
    double own(Kind, std::size_t texel, std::int32_t island, const float *value,
               std::array<float, 4> &mean) const {
        if (layout_.owner[texel] != island) {
            return 0.0;
        }
        if (whole(texel)) {
            std::copy_n(value, channels, mean.begin());
        } else {
            mean = mean_of<channels>(kind_, first(texel));
        }
        return 1.0;
    }

    const std::size_t rows;
    const std::size_t columns;

  private:
    const Kind kind_;
    const float *texels_;
    const Layout &layout_;
};

// A coarser level.
class Means {
  public:
    // Each texel gathers the texels of the level before that its area covers: a Finest, or Means.
    template <typename Finer>
    static Means halved(const Finer &finer);

    bool whole(std::size_t texel) const { return whole_[texel] != 0; }
    bool single(std::size_t texel) const { return first_[texel + 1] == first_[texel] + 1; }
    std::int32_t island(std::size_t texel) const { return parts_[first_[texel]].island; }
    const Part &first(std::size_t texel) const { return parts_[first_[texel]]; }
    std::span<const Part> parts(std::size_t texel) const {
        return {parts_.data() + first_[texel], parts_.data() + first_[texel + 1]};
    }

    // As of Finest.
    template <std::size_t channels>
    double own(Kind kind, std::size_t texel, std::int32_t island, const float *value,
               std::array<float, 4> &mean) const {
        const std::span<const Part> all = parts(texel);
        const auto it = std::ranges::lower_bound(all, island, {}, &Part::island);
        if (it == all.end() || it->island != island) {
            return 0.0;
        }
        if (whole(texel)) {
            std::copy_n(value, channels, mean.begin());
            return 1.0;
        }
        mean = mean_of<channels>(kind, *it);
        return static_cast<double>(it->share);
    }

    std::size_t rows;
    std::size_t columns;

  private:
    Means(std::size_t r, std::size_t c) : rows(r), columns(c) {}

    std::vector<std::uint32_t> first_; // of each texel among the parts; one more at the end
    std::vector<Part> parts_;          // of each texel, by island
    std::vector<std::uint8_t> whole_;  // the texel lies wholly inside one island
};

// The cells of a finer line that a cell of a coarser one covers, with the lengths covered, in finer cells.
struct Cover {
    std::size_t first = 0;
    std::size_t count = 0;
    std::array<float, 3> length{};
};

std::vector<Cover> covers(std::size_t fine, std::size_t coarse);

template <typename Finer>
Means Means::halved(const Finer &finer) {
    Means next(std::max<std::size_t>(1, finer.rows / 2), std::max<std::size_t>(1, finer.columns / 2));
    const std::size_t count = next.rows * next.columns;
    std::vector<Part> &parts = next.parts_;
    parts.reserve(count + count / 8);
    next.whole_.reserve(count);
    next.first_.reserve(count + 1);
    next.first_.push_back(0);
    const auto before = [](const Part &a, const Part &b) { return a.island < b.island; };
    const std::vector<Cover> wide = covers(finer.columns, next.columns);
    std::vector<Part> found;
    for (const Cover &down : covers(finer.rows, next.rows)) {
        for (const Cover &across : wide) {
            const std::size_t corner = down.first * finer.columns + across.first;
            const auto each = [&](auto &&with) {
                for (std::size_t j = 0; j < down.count; ++j) {
                    for (std::size_t i = 0; i < across.count; ++i) {
                        with(corner + j * finer.columns + i, down.length[j] * across.length[i]);
                    }
                }
            };
            bool whole = true;
            bool alone = true; // all that is covered is one island's
            each([&](std::size_t texel, float) {
                whole = whole && finer.whole(texel);
                alone = alone && finer.single(texel) && finer.island(texel) == finer.island(corner);
            });
            const std::size_t start = parts.size();
            if (alone) {
                Part sum = finer.first(corner).of(down.length[0] * across.length[0]);
                each([&](std::size_t texel, float area) {
                    if (texel != corner) {
                        sum.add(finer.first(texel).of(area));
                    }
                });
                parts.push_back(sum);
            } else {
                found.clear();
                each([&](std::size_t texel, float area) {
                    for (const Part &part : finer.parts(texel)) {
                        found.push_back(part.of(area));
                    }
                });
                std::stable_sort(found.begin(), found.end(), before);
                for (const Part &part : found) {
                    if (parts.size() == start || parts.back().island != part.island) {
                        parts.push_back(part);
                    } else {
                        parts.back().add(part);
                    }
                }
            }
            next.first_.push_back(static_cast<std::uint32_t>(parts.size()));
            next.whole_.push_back(whole && alone ? 1 : 0);
        }
    }
    return next;
}

} // namespace paradize::gutter
