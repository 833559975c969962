// Area means of a map at every mip level, row by row and in little memory. For metrics only.
//
// A texel of level k holds the mean of level 0 over the area that it covers; where the size is odd these
// areas cut texels, which then count by the part that lies inside. That is not the mean of the level before:
// two odd sizes in a row make it another.
#pragma once

#include <cstddef>
#include <memory>

#include "reference/maps/texels.hpp"

namespace paradize::reference {

// Rows of some level, each `channels` planes of `columns` doubles, one after the other.
class Rows {
  public:
    Rows() = default;
    Rows(const Rows &) = default;
    Rows &operator=(const Rows &) = delete;
    virtual ~Rows() = default;
    virtual std::size_t channels() const = 0;
    virtual void row(std::size_t y, double *out) = 0;
    // Another that gives the same rows, for another thread.
    virtual std::unique_ptr<Rows> fresh() const = 0;
};

// Is shown every row of every level once, in an order that depends on the threads.
class Comparer {
  public:
    Comparer() = default;
    Comparer(const Comparer &) = delete;
    Comparer &operator=(const Comparer &) = delete;
    virtual ~Comparer() = default;
    virtual void row(std::size_t level, std::size_t y, const double *truth) = 0;
};

void widen(const float *__restrict from, std::size_t count, double *__restrict to);

// Shows the means of levels [0, levels) of level 0's rows to comparers, one per thread.
void feed_levels(Size size, std::size_t levels, const Rows &level0,
                 std::span<const std::unique_ptr<Comparer>> comparers);

} // namespace paradize::reference
