#pragma once
// The waves that lift the sea near the camera, as shaders/lib/near_waves.glsl takes them. Uses no GL.

#include "assets/scene/file.hpp"
#include "scene/view.hpp"

#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include <array>
#include <vector>

namespace paradize {

inline constexpr int near_wave_count = 4;
/// Cells of the sea's grid near the eye along the longest wave; the shortest one has five. Finer ones cost
/// more than they show: software rasterisers shade the pixels at edges of small triangles more than once.
inline constexpr float cells_per_wave = 9.0F;
/// Each wave has faded out at so many of its lengths from the eye (shaders/lib/near_waves.glsl).
inline constexpr float fade_lengths = 2.0F;

/// Each wave: x, y, 2 pi / length along its direction, rad/m; z, phase at the anchor, rad in [0, 2 pi); w,
/// amplitude, m.
using NearWaves = std::array<glm::vec4, near_wave_count>;

/// Periods in a flight of a wave with a wave number, rad/m: the whole number nearest to the speed of waves in
/// deep water, so that the wave repeats with the flight.
double wave_periods(double wave_number, double duration_s);

/// Returns the waves at a second. Found in double and wrapped: smooth after days.
/// They are lower where the main view's eye is near the surface, so that none reaches it.
NearWaves near_waves_at(const assets::SceneFile &file, double elapsed_s, const View &main);

/// The middle of the sea's grid in the view's coordinates. It moves with the eye by whole cells, so that
/// vertices keep their places in the world.
glm::vec2 grid_center(const assets::Water &water, const View &view);

/// The share of their height that waves have in each cell of a grid over the terrain: 0 where the ground is
/// above the water or near below it, 1 in deep water. One cell of 1 where there is no grid.
struct WaveShares {
    int columns = 1, rows = 1;
    std::vector<float> shares{1.0F}; // row by row from -X, -Z
    glm::vec2 per_m{0.0F};           // widths of the grid per metre; 0: the one cell is everywhere
    glm::dvec2 corner_m{0.0};        // at -X, -Z, world
};
WaveShares wave_shares(const assets::SceneFile &file);

} // namespace paradize
