#pragma once
// How bright each light is at one moment. Uses no GL.

#include "assets/scene/file.hpp"

namespace paradize {

/// A moment of the show: seconds of the flight, and since the start.
struct Moment {
    double flight_s = 0.0, elapsed_s = 0.0;
};

/// Returns the share of its full strength that a light has, 0 to 1. The same moment gives the same share.
/// Flicker runs on through the flights. `number`: of the light, so that no two flicker together.
float light_strength(const assets::PointLight &light, std::size_t number, const Moment &moment,
                     double duration_s);

} // namespace paradize
