#pragma once
// Ripples round what stands in the water, as shaders/lib/ripples.glsl takes them. Uses no GL.

#include "assets/scene/file.hpp"
#include "scene/view.hpp"

#include <glm/vec4.hpp>

#include <array>

namespace paradize {

inline constexpr int most_rings = 8;

/// The circles nearest to the eye.
struct Ripples {
    std::array<glm::vec4, most_rings> rings{}; // x, z, radius, m; slope of the ripples at the rim
    int count = 0;
    float phase = 0.0F; // rad in [0, 2 pi)
};

/// Returns the ripples at a second that the view may see. They run a whole number of periods in a flight.
/// They swell and sink, each circle at its own time, as waves come that they answer. Allocates nothing.
Ripples ripples_at(const assets::SceneFile &file, double elapsed_s, const View &view);

} // namespace paradize
