#pragma once
// Rounds rates to whole cycles in a flight, so that its end meets its beginning. Uses no GL.

#include <cmath>

namespace paradize {

/// Cycles in a flight up to which a rate is not rounded: a motion so slow would stand still, or rush.
inline constexpr double least_cycles = 0.5;

/// The rate nearest to `per_s` with whole cycles, at least one, in a flight of `duration_s`.
inline double whole_cycles_per_s(double per_s, double duration_s) {
    const double cycles = per_s * duration_s;
    return std::abs(cycles) < least_cycles ? per_s : std::round(cycles) / duration_s;
}

} // namespace paradize
