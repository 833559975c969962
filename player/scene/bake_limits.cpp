#include "scene/bake_limits.hpp"

#include <utility>

namespace paradize {

std::string BakeLimits::report(bool &reported, std::string text) {
    reported = true;
    return messages_.emplace_back(std::move(text));
}

std::string BakeLimits::check_size(int width_px, int height_px) {
    if (untrimmed_ || reported_size_ ||
        (width_px <= file_.largest_width_px && height_px <= file_.largest_height_px)) {
        return "";
    }
    const auto size = [](int width, int height) {
        return std::to_string(width) + " x " + std::to_string(height);
    };
    return report(reported_size_, "the picture is " + size(width_px, height_px) +
                                      " pixels, but the scene was baked for at most " +
                                      size(file_.largest_width_px, file_.largest_height_px) +
                                      ": finer data was left out, the finest baked data is shown; raise "
                                      "`largest_viewport` in the scene and bake it again");
}

std::string BakeLimits::check_camera(const glm::dvec3 &eye) {
    if (untrimmed_ || reported_camera_) {
        return "";
    }
    if (!file_.free_camera) {
        return report(reported_camera_,
                      "the scene declares no [free_camera]: away from its flight surfaces may look "
                      "coarse, the finest baked data is shown");
    }
    const assets::FreeCameraBox &region = *file_.free_camera;
    for (int axis = 0; axis < 3; ++axis) {
        if (eye[axis] < region.low[axis] || eye[axis] > region.high[axis]) {
            return report(reported_camera_,
                          "the camera has left the region that the scene was baked for: the finest "
                          "baked data is shown; widen [free_camera] in the scene and bake it again");
        }
    }
    return "";
}

} // namespace paradize
