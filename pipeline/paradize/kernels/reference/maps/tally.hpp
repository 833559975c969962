// Sum, largest and exact percentile of many numbers without keeping them. For metrics only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace paradize::reference {

// The sums of one level. sum: of angles, or of squared differences.
struct LevelError {
    std::uint64_t count = 0;
    double sum = 0.0;
    double p99 = 0.0; // the smallest of the numbers that 99 of 100 do not pass
    double max = 0.0;
    double alpha_squares = 0.0; // over alpha_count texels
    std::uint64_t alpha_count = 0;
};

// How many of n numbers lie at the 99th percentile or above it: n less its rank from 0.
std::size_t above_p99(std::size_t n);

// The largest numbers of a stream: exactly the `keep` largest, whatever the order in which they come, so that
// tallies of several threads may be joined. Memory: twice `keep` numbers at most.
class Largest {
  public:
    explicit Largest(std::size_t keep) : keep_(keep) {}

    // values: not negative, no NaN.
    void add(std::span<const double> values);
    void join(const Largest &other) { add(other.held_); }
    // The k-th largest, 1 <= k <= keep and not more than were added; reorders what is held.
    double kth(std::size_t k);

  private:
    void prune();

    std::size_t keep_;
    double least_ = -1.0; // what is not above it is not among the largest
    std::vector<double> held_;
};

// The sum, in an order that depends on nothing but their number.
double ordered_sum(std::span<const double> values);

} // namespace paradize::reference
