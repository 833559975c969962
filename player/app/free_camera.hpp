#pragma once
// The camera of --interactive.

#include "app/window.hpp"
#include "scene/flight.hpp"

namespace paradize {

class FreeCamera {
  public:
    /// Starts at the pose `start`.
    explicit FreeCamera(const Pose &start);
    void move(const Input &input, double delta_s);
    Pose pose() const;

  private:
    glm::dvec3 forward() const;

    glm::dvec3 eye_;
    double yaw_rad_ = 0.0;   // from -Z towards +X
    double pitch_rad_ = 0.0; // upwards positive; stays below 90 degrees
    double roll_rad_ = 0.0;
};

} // namespace paradize
