#pragma once
// What a picture asks of a bake that left out what no view of the flight asks for.

#include "assets/scene_file.hpp"

#include <glm/vec3.hpp>

#include <string>
#include <vector>

namespace paradize {

/// Says once of each limit of a bake that a run goes beyond it: the largest picture, the free camera's
/// region. Then the finest there is is shown. Nothing is said of a bake that left nothing out.
class BakeLimits {
  public:
    explicit BakeLimits(const assets::SceneFile &file) : file_(file), untrimmed_(!file.is_trimmed()) {}

    /// What is to be said of a picture of this size; empty: nothing, or it was said.
    std::string check_size(int width_px, int height_px);
    /// The same of a steered camera, at its eye.
    std::string check_camera(const glm::dvec3 &eye);

    /// All that was said.
    const std::vector<std::string> &messages() const { return messages_; }

  private:
    std::string report_once(bool &reported, std::string text);

    const assets::SceneFile &file_;
    bool untrimmed_ = true, reported_size_ = false, reported_camera_ = false;
    std::vector<std::string> messages_;
};

} // namespace paradize
