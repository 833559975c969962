#pragma once
// The camera pose at a second of the flight. Uses double, because playback runs for days.

#include "assets/scene/file.hpp"

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

namespace paradize {

struct Pose {
    glm::dvec3 eye{0.0};
    glm::dvec3 target{0.0, 0.0, -1.0};
    double roll_rad = 0.0; // positive: the horizon tilts down to the left
};

/// Wraps any time into [0, duration). t and t + n duration give the same result up to rounding of t.
double flight_second(double elapsed_s, double duration_s);

/// Returns the pose at `time_s` (wrapped into the flight). The time table's cubic Hermite gives the spline
/// parameter, the segment's cubics give eye, target and roll.
Pose flight_pose(const assets::Flight &flight, double time_s);

/// Returns the matrix from world to eye space. An eye at its target looks along -Z. A vertical view direction
/// uses -Z or +Z as its up vector.
glm::mat4 view_matrix(const Pose &pose);

} // namespace paradize
