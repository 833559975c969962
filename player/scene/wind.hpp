#pragma once
// The wind at one moment, as shaders/lib/wind.glsl takes it. Uses no GL.

#include "assets/scene/file.hpp"

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

namespace paradize {

struct WindNow {
    glm::vec4 direction{0.0F}; // x, y: where it blows to, along X and Z, unit; z: of its gusts, rad/m
    // rad in [0, 2 pi), at the anchor: of the gusts, of those that run across them, of the sway that they
    // make, of the flutter
    glm::vec4 phases{0.0F};
};

/// Phases are found in double and wrapped, so that the wind is smooth after days and far from the origin. The
/// same second gives the same wind, and its waves repeat with a flight of `duration_s`, save slow ones
/// (repeating.hpp).
WindNow wind_now(const assets::Wind &wind, double duration_s, double elapsed_s, const glm::dvec3 &anchor);

} // namespace paradize
