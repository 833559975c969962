#include "free_camera.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace paradize {

namespace {

constexpr double walk_m_per_s = 4.0;
constexpr double run = 5.0;
constexpr double turn_rad_per_px = 0.0025;
constexpr double steepest_rad = 1.55;

} // namespace

FreeCamera::FreeCamera(const Pose &start) : eye_(start.eye) {
    const glm::dvec3 way = start.target - start.eye;
    const double flat = std::hypot(way.x, way.z);
    if (flat > 1e-9) {
        yaw_rad_ = std::atan2(way.x, -way.z);
    }
    pitch_rad_ = std::clamp(std::atan2(way.y, flat), -steepest_rad, steepest_rad);
}

glm::dvec3 FreeCamera::forward() const {
    return {std::sin(yaw_rad_) * std::cos(pitch_rad_), std::sin(pitch_rad_),
            -std::cos(yaw_rad_) * std::cos(pitch_rad_)};
}

void FreeCamera::move(const Input &input, double delta_s) {
    yaw_rad_ = std::remainder(yaw_rad_ + input.turn_px * turn_rad_per_px, 2.0 * 3.14159265358979323846);
    pitch_rad_ = std::clamp(pitch_rad_ - input.tilt_px * turn_rad_per_px, -steepest_rad, steepest_rad);
    const glm::dvec3 right(std::cos(yaw_rad_), 0.0, std::sin(yaw_rad_));
    const double way = walk_m_per_s * (input.fast ? run : 1.0) * delta_s;
    eye_ += (forward() * static_cast<double>(input.forward) + right * static_cast<double>(input.right) +
             glm::dvec3(0.0, static_cast<double>(input.up), 0.0)) *
            way;
}

Pose FreeCamera::pose() const {
    return {eye_, eye_ + forward(), 0.0};
}

} // namespace paradize
