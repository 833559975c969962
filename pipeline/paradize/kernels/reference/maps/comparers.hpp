// Shared by all comparisons of a map's levels: decoded rows, sums and percentiles. For metrics only.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "reference/maps/chain.hpp"
#include "reference/maps/maps.hpp"

namespace paradize::reference {

// Sums of each row of each level, which threads fill side by side.
struct RowSums {
    explicit RowSums(const TextureView &texture);

    struct Level {
        std::vector<double> sums;
        std::vector<std::uint64_t> counts;
        std::vector<double> alpha_squares;
    };
    std::vector<Level> levels;
};

// A comparer with a thread's own decoders and its own largest errors of every level.
class MapComparer : public Comparer {
  public:
    // errors_per_texel: how many numbers a texel gives.
    MapComparer(const TextureView &texture, std::size_t errors_per_texel, RowSums &sums);

    // The results of all comparers of one kind as one. Reorders what they hold.
    static std::vector<LevelError> results(std::vector<std::unique_ptr<Comparer>> &comparers,
                                           const RowSums &sums);

  protected:
    // Channel c of a decoded row, as doubles, in `to`.
    void decoded(std::size_t level, std::size_t y, std::size_t c, double *to);
    // Takes a row's errors into account; of them `count`, whose sum is `sum`.
    void take(std::size_t level, std::size_t y, std::span<const double> errors, double sum);
    std::size_t columns(std::size_t level) const { return level_size(size_, level).columns; }

    RowSums &sums_;

  private:
    Size size_;
    std::vector<TexelRows> texels_;
    std::vector<Largest> largest_;
};

// Puts the errors of texels that lie wholly inside (mask above 1 - 1e-9) first; returns how many.
std::size_t only_inside(double *errors, const double *mask, std::size_t count);

// |truth - found| of a row into errors, their squares' sum as the result. squares: as many doubles of
// scratch.
double differences(const double *truth, const double *found, std::size_t count, double *errors,
                   double *squares);

// Shows all levels to `threads` comparers that `make` makes, and returns what they found.
template <typename Make>
std::vector<LevelError> compare_levels(const TextureView &texture, const Rows &truth, int threads,
                                       const Make &make) {
    RowSums sums(texture);
    std::vector<std::unique_ptr<Comparer>> comparers;
    for (int k = 0; k < (threads < 1 ? 1 : threads); ++k) {
        comparers.push_back(make(sums));
    }
    feed_levels(texture.size, texture.levels.size(), truth, comparers);
    return MapComparer::results(comparers, sums);
}

} // namespace paradize::reference
