#pragma once
// Builds the views of a frame: main camera, camera mirrored in the water, refraction and light.

#include "assets/scene/file.hpp"
#include "scene/flight.hpp"
#include "scene/quality.hpp"
#include "scene/view.hpp"

#include <glm/vec2.hpp>

#include <array>

namespace paradize {

/// The clip planes lie this far behind the water surface, so that distorted lookups at the shore find a
/// colour.
inline constexpr float clip_margin_m = 0.05F;

/// Returns the floating origin for an eye: 0 along each axis where the eye is near the world's origin, else a
/// multiple of 1024 m near the eye.
glm::dvec3 anchor_of(const glm::dvec3 &eye);

/// Pixels of a side that is drawn at `scale`, at least one.
int scaled_px(int px, float scale);

/// The main camera.
View main_view(const Pose &pose, const assets::Flight &flight, int width_px, int height_px);
/// The camera mirrored in the plane y = level_m (world). `scale` multiplies its resolution. Clips what lies
/// below the water.
View mirror_view(const View &main, double level_m, float scale);
/// The main camera at `scale` times its resolution. Clips what lies above the water.
View refraction_view(const View &main, double level_m, float scale);
/// Orthographic view from the sun over the square of the shadow map.
View light_view(const assets::Shadow &shadow, const glm::vec3 &to_sun,
                const glm::dvec3 &anchor = glm::dvec3(0.0));

/// Returns the views of a frame, at the index of their kind. The size is that of the shown picture. `pixel`
/// shifts the main and the light view by a fraction of their pixels.
std::array<View, view_kinds> frame_views(const assets::SceneFile &file, const RenderSettings &settings,
                                         const Pose &pose, int width_px, int height_px,
                                         const glm::vec3 &to_sun, const glm::vec2 &pixel = glm::vec2(0.0F));

/// Maps the light's clip space to [0,1]^3 of the shadow map.
glm::mat4 texture_from_clip();

/// Shifts the view by a fraction of its own pixel, x to the right, y upwards.
void jitter(View &view, const glm::vec2 &pixels);

/// Computes view_projection and the frustum planes from view and projection.
void finish_view(View &view);

} // namespace paradize
