#pragma once
// Speeds that make what moves be at a flight's end where it began. Uses no GL.

#include <cmath>

namespace paradize {

/// Motion that repeats less often in a flight keeps its own speed: rounded, it would stand still, or rush.
inline constexpr double least_repeats = 0.5;

/// The rate next to `per_s` that happens a whole number of times, at least once, in a flight of `duration_s`.
inline double repeating(double per_s, double duration_s) {
    const double times = std::abs(per_s) * duration_s;
    return times < least_repeats ? per_s
                                 : std::copysign(std::fmax(1.0, std::round(times)) / duration_s, per_s);
}

} // namespace paradize
