#pragma once
// Checks whether the bake covers what is drawn. A bake leaves out mips and LODs that no view of the flight
// needs.

#include "assets/scene/file.hpp"

#include <glm/vec3.hpp>

#include <string>
#include <vector>

namespace paradize {

/// Returns one warning per limit that playback exceeds: the largest picture and the free camera's region. The
/// player then shows the finest data that was baked. There are no warnings for a bake that left nothing out.
class BakeLimits {
  public:
    explicit BakeLimits(const assets::SceneFile &file) : file_(file), untrimmed_(!file.is_trimmed()) {}

    /// Returns a warning if the picture is larger than the scene was baked for. Empty if it is not, or if the
    /// warning was returned before; allocates nothing then.
    std::string check_size(int width_px, int height_px);
    /// The same for the eye of the free camera.
    std::string check_camera(const glm::dvec3 &eye);

    /// All warnings so far.
    const std::vector<std::string> &messages() const { return messages_; }

  private:
    std::string report(bool &reported, std::string text);

    const assets::SceneFile &file_;
    bool untrimmed_ = true, reported_size_ = false, reported_camera_ = false;
    std::vector<std::string> messages_;
};

} // namespace paradize
