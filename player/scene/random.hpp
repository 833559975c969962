#pragma once
// Random numbers that are the same on every machine.

#include <cstdint>

namespace paradize {

/// A portable random generator, the same on every machine: PCG32, M. O'Neill, "PCG: A Family of Simple Fast
/// Space-Efficient Statistically Good Algorithms for Random Number Generation", 2014.
class Pcg {
  public:
    explicit Pcg(std::uint64_t stream) : increment_((stream << 1U) | 1U) {
        next();
        state_ += 0x853c49e6748fea9bULL;
        next();
    }
    std::uint32_t next();
    /// Returns a uniform number in [low, high).
    float uniform(float low, float high);

  private:
    std::uint64_t state_ = 0;
    std::uint64_t increment_;
};

} // namespace paradize
