#include "scene/view.hpp"

#include <glm/geometric.hpp>

namespace paradize {

bool View::sees(const glm::vec3 &center, float radius_m) const {
    for (const glm::vec4 &plane : planes) {
        if (glm::dot(glm::vec3(plane), center) + plane.w < -radius_m) {
            return false;
        }
    }
    return !clipped || glm::dot(glm::vec3(clip_plane), center) + clip_plane.w >= -radius_m;
}

} // namespace paradize
