#pragma once
// Cascades of the shadow map: squares around what the camera sees, each finer than the one before.

#include "assets/scene/file.hpp"
#include "scene/view.hpp"

#include <glm/vec4.hpp>

namespace paradize {

/// Most cascades of the shadow map.
inline constexpr int max_cascades = 3;
/// Each cascade's texels are this much smaller than those of the one before.
inline constexpr int cascade_ratio = 3;

/// Returns the light's view of one cascade, of the size in texels of `light`, which is the view of the whole
/// square of `shadow` (scene/camera.hpp) and cascade 0. A finer cascade covers a sphere that the main camera
/// looks into, as large as fits. Its size does not depend on the camera, and it moves in steps of whole
/// texels, so that texels keep their places in the world: M. Valient, "Stable Rendering of Cascaded Shadow
/// Maps", ShaderX6, 2008. The steps are an eighth of its side, so that most frames find it drawn. It stays
/// inside the whole square.
View cascade_view(const assets::Shadow &shadow, const View &light, const View &main, int cascade);

/// Returns how the shader finds a point in a cascade: scale, then offset along x and y, from coordinates in
/// [0, 1] of the whole square; then metres per texel.
glm::vec4 cascade_fit(const assets::Shadow &shadow, const View &light, const View &cascade);

} // namespace paradize
