#pragma once
// Views of one frame: the picture's camera, its mirror image under the water, the light's.

#include "assets/scene_file.hpp"
#include "scene/flight.hpp"
#include "scene/view.hpp"

#include <glm/vec2.hpp>

namespace paradize {

/// Clip planes stand this far on the other side of the water, so that shaken lookups at its edge find
/// something.
inline constexpr float clip_margin_m = 0.05F;

/// Where a view from this eye counts its coordinates from: 0 along each axis that it is near on, else a
/// multiple of 1024 m next to it.
glm::dvec3 anchor_of(const glm::dvec3 &eye);

/// The picture's camera.
View main_view(const Pose &pose, const assets::Flight &flight, int width_px, int height_px);
/// The camera mirrored in the plane y = level_m of the world, `scale` times as fine; keeps what is above the
/// water.
View mirror_view(const View &main, double level_m, float scale);
/// The picture's camera, `scale` times as fine; keeps what is below the water.
View refraction_view(const View &main, double level_m, float scale);
/// Parallel light over the square of the shadow map.
View light_view(const assets::Shadow &shadow, const glm::vec3 &to_sun,
                const glm::dvec3 &anchor = glm::dvec3(0.0));

/// [0,1]^3 of the light's map from its clip space.
glm::mat4 texture_from_clip();

/// Moves what a view sees by a part of its own pixel, x to the right and y up.
void jitter(View &view, const glm::vec2 &pixels);

/// Fills view_projection and the frustum's planes from view and projection.
void finish_view(View &view);

} // namespace paradize
