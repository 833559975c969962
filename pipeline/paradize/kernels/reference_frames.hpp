// How far tangent frames are from others, and whether they are frames at all. For metrics only.
#pragma once

#include <span>

namespace paradize::reference {

// Angle in degrees, 0 to 180, between corresponding rows of two (n, 3) arrays of any length but zero, in
// float64 by atan2(|a x b|, a . b), exact near 0 and 180 degrees alike; 90 for a row without a direction.
void angles_deg(std::span<const float> a, std::span<const float> b, std::span<double> out);

} // namespace paradize::reference
