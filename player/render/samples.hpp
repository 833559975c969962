#pragma once
// Sample positions of --reference, inside the pixel and on the sun's disc.

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <vector>

namespace paradize {

struct Sample {
    glm::vec2 pixel{0.0F}; // offset from the pixel's centre, in pixels, about [-0.5, 0.5]
    glm::vec2 sun{0.0F};   // point in the disc of radius 1
};

/// Returns `count` (at least 1) samples. Their mean is the centre, so that the averaged picture is not
/// shifted against a normal frame. Halton points in bases 2, 3, 5 and 7: J. Halton, "On the Efficiency of
/// Certain Quasi-random Sequences of Points in Evaluating Multi-dimensional Integrals", 1960. Disc mapping:
/// P. Shirley, K. Chiu, "A Low Distortion Map Between Disk and Square", 1997.
std::vector<Sample> reference_samples(int count);

/// Returns the unit direction towards a point of the sun's disc. `to_sun` is the direction towards its
/// centre, `disc_point` lies in the disc of radius 1.
glm::vec3 sun_direction(const glm::vec3 &to_sun, float angular_radius_rad, const glm::vec2 &disc_point);

} // namespace paradize
