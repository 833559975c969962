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
    explicit BakeLimits(const assets::SceneFile &file) : file_(file), silent_(!file.leaves_out()) {}

    /// What is to be said of a picture of this size; empty: nothing, or it was said.
    std::string picture(int width_px, int height_px);
    /// The same of a steered camera, at its eye.
    std::string steered(const glm::dvec3 &eye);

    /// All that was said.
    const std::vector<std::string> &said() const { return said_; }

  private:
    std::string say(bool &told, std::string text);

    const assets::SceneFile &file_;
    bool silent_ = true, told_picture_ = false, told_steered_ = false;
    std::vector<std::string> said_;
};

} // namespace paradize
