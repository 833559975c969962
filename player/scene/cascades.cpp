#include "scene/cascades.hpp"

#include "scene/camera.hpp"

#include <glm/ext/matrix_clip_space.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>

namespace paradize {

namespace {

constexpr int steps_per_side = 8;

} // namespace

View cascade_view(const assets::Shadow &shadow, const View &light, const View &main, int cascade) {
    if (cascade == 0) {
        return light;
    }
    const auto extent_m = static_cast<double>(shadow.extent_m);
    const double side_m = extent_m / std::pow(cascade_ratio, cascade);
    const double step_m = side_m / light.width_px * std::max(1, light.width_px / steps_per_side);

    // The largest slice of the frustum that starts at the eye and whose bounding sphere fits, wherever the
    // steps put it.
    const double radius_m = std::max(side_m - step_m, 0.0) / 2.0;
    const double corner = std::hypot(1.0 / static_cast<double>(main.projection[0][0]),
                                     1.0 / static_cast<double>(main.projection[1][1]));
    const glm::dvec3 forward = -glm::dvec3(glm::transpose(glm::mat3(main.view))[2]);
    const glm::dvec3 center =
        glm::dvec3(main.eye) + main.anchor + forward * (radius_m / std::max(corner, 1.0)) - shadow.center;

    const glm::mat3 axes = glm::transpose(glm::mat3(light.view));
    const double limit_m = std::floor((extent_m - side_m) / 2.0 / step_m) * step_m;
    const auto place = [&](int axis) {
        const double along_m = glm::dot(glm::dvec3(axes[axis]), center);
        return std::clamp(std::round(along_m / step_m) * step_m, -limit_m, limit_m);
    };
    const auto x = static_cast<float>(place(0));
    const auto y = static_cast<float>(place(1));
    const auto half = static_cast<float>(side_m / 2.0);
    View out = light;
    out.projection = glm::ortho(x - half, x + half, y - half, y + half, light.near_m, light.far_m);
    finish_view(out);
    return out;
}

glm::vec4 cascade_fit(const assets::Shadow &shadow, const View &light, const View &cascade) {
    // Both share the light's axes, so that clip coordinates differ by a scale and an offset.
    const glm::mat4 &whole = light.projection;
    const glm::mat4 &part = cascade.projection;
    const float scale = part[0][0] / whole[0][0];
    const glm::vec2 offset = glm::vec2(part[3]) - scale * glm::vec2(whole[3]);
    const glm::vec2 of_texture = 0.5F * (offset + 1.0F - scale);
    const float side_m = shadow.extent_m / scale;
    return {scale, of_texture.x, of_texture.y, side_m / static_cast<float>(light.width_px)};
}

} // namespace paradize
