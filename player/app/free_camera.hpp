#pragma once
// The camera that a person steers (--interactive).

#include "app/window.hpp"
#include "scene/flight.hpp"

namespace paradize {

class FreeCamera {
  public:
    /// Starts where the flight is.
    explicit FreeCamera(const Pose &start);
    void move(const Input &input, double delta_s);
    Pose pose() const;

  private:
    glm::dvec3 forward() const;

    glm::dvec3 eye_;
    double yaw_rad_ = 0.0;   // from -Z to +X
    double pitch_rad_ = 0.0; // up is positive; never quite straight up or down
    double roll_rad_ = 0.0;
};

} // namespace paradize
