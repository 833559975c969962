#pragma once
// Where the frames that --reference averages look: inside a pixel, and over the sun's disc.

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <vector>

namespace paradize {

struct Sample {
    glm::vec2 pixel{0.0F}; // from the pixel's middle, pixels, in [-0.5, 0.5] but for the rounding of the mean
    glm::vec2 sun{0.0F};   // in the disc of radius 1
};

/// `count` samples, at least 1; their mean is the middle, so that the average is not shifted against an
/// ordinary frame. Points of J. Halton, "On the Efficiency of Certain Quasi-random Sequences of Points in
/// Evaluating Multi-dimensional Integrals", 1960, bases 2, 3, 5, 7; the disc by P. Shirley, K. Chiu, "A Low
/// Distortion Map Between Disk and Square", 1997.
std::vector<Sample> reference_samples(int count);

/// Unit, towards a place of the sun's disc (radius 1) whose middle is towards `to_sun`.
glm::vec3 sun_direction(const glm::vec3 &to_sun, float angular_radius_rad, const glm::vec2 &disc_point);

} // namespace paradize
