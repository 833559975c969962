#include "app/free_camera.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace paradize {

namespace {

constexpr double speed_m_per_s = 4.0;
constexpr double fast_factor = 5.0;
constexpr double look_rad_per_px = 0.0025;
constexpr double roll_rad_per_s = 0.6;
constexpr double max_pitch_rad = 1.55;

} // namespace

FreeCamera::FreeCamera(const Pose &start) : eye_(start.eye), roll_rad_(start.roll_rad) {
    const glm::dvec3 way = start.target - start.eye;
    const double flat = std::hypot(way.x, way.z);
    if (flat > 1e-9) {
        yaw_rad_ = std::atan2(way.x, -way.z);
    }
    pitch_rad_ = std::clamp(std::atan2(way.y, flat), -max_pitch_rad, max_pitch_rad);
}

glm::dvec3 FreeCamera::forward() const {
    return {std::sin(yaw_rad_) * std::cos(pitch_rad_), std::sin(pitch_rad_),
            -std::cos(yaw_rad_) * std::cos(pitch_rad_)};
}

void FreeCamera::move(const Input &input, double delta_s) {
    constexpr double full_turn_rad = 2.0 * std::numbers::pi;
    yaw_rad_ = std::remainder(yaw_rad_ + input.yaw_px * look_rad_per_px, full_turn_rad);
    roll_rad_ =
        std::remainder(roll_rad_ + static_cast<double>(input.roll) * roll_rad_per_s * delta_s, full_turn_rad);
    pitch_rad_ = std::clamp(pitch_rad_ - input.pitch_px * look_rad_per_px, -max_pitch_rad, max_pitch_rad);
    const glm::dvec3 right(std::cos(yaw_rad_), 0.0, std::sin(yaw_rad_));
    const double way = speed_m_per_s * (input.fast ? fast_factor : 1.0) * delta_s;
    eye_ += (forward() * static_cast<double>(input.forward) + right * static_cast<double>(input.right) +
             glm::dvec3(0.0, static_cast<double>(input.up), 0.0)) *
            way;
}

Pose FreeCamera::pose() const {
    return {eye_, eye_ + forward(), roll_rad_};
}

} // namespace paradize
