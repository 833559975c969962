#pragma once
// One view of the scene: main camera, mirror, refraction or light.

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <array>

namespace paradize {

enum class ViewKind { light, mirror, refraction, main };
inline constexpr int view_kinds = 4;

struct View {
    ViewKind kind = ViewKind::main;
    // The floating origin. All coordinates of this view (matrices, planes, positions) are relative to this
    // world position, so that float32 stays precise far from the world's origin.
    glm::dvec3 anchor{0.0};
    glm::mat4 view{1.0F};
    glm::mat4 projection{1.0F};
    glm::mat4 view_projection{1.0F};
    glm::vec3 eye{0.0F};                          // of this view: below the water for the mirror
    glm::vec4 clip_plane{0.0F, 0.0F, 0.0F, 1.0F}; // kept where dot(plane, (p, 1)) >= 0
    bool clipped = false;                         // gl_ClipDistance[0] is enabled
    bool mirrored = false;                        // triangle winding is reversed
    int width_px = 0;
    int height_px = 0;
    int samples = 0; // of a pixel; 0 or 1: no multisampling
    float near_m = 0.0F;
    float far_m = 0.0F;
    float pixels_at_1m = 1.0F;         // pixels per metre at a distance of one metre; 0 for the light
    std::array<glm::vec4, 6> planes{}; // frustum planes, unit normals pointing inwards

    /// Converts a world position, or a model matrix in double precision, to this view's coordinates.
    glm::vec3 local(const glm::dvec3 &world) const { return {world - anchor}; }
    glm::mat4 local(glm::dmat4 model) const {
        model[3] -= glm::dvec4(anchor, 0.0);
        return {model};
    }

    /// True if any part of the sphere is inside the frustum and on the kept side of the clip plane.
    bool sees(const glm::vec3 &center, float radius_m) const;
};

} // namespace paradize
