#pragma once
// Where the camera is at a second of the flight. In double: the show runs for days.

#include "assets/scene_file.hpp"

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

namespace paradize {

struct Pose {
    glm::dvec3 eye{0.0};
    glm::dvec3 target{0.0, 0.0, -1.0};
    double roll_rad = 0.0; // positive: the horizon falls to the left
};

/// Second in [0, duration) for any second; t and t + n duration agree to the last bits of t.
double flight_second(double elapsed_s, double duration_s);

/// The pose at second `time_s` (reduced modulo the duration): the time table's cubic Hermite gives the place
/// on the spline, the segment's cubics give eye, target and roll.
Pose flight_pose(const assets::Flight &flight, double time_s);

/// Eye from world. Guards: an eye on its target looks along -Z, a look straight up or down takes -Z / +Z as
/// up.
glm::mat4 view_matrix(const Pose &pose);

} // namespace paradize
