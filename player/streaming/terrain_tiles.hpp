#pragma once
// The terrain of a scene: its tiles as they arrive, the cut of the frame, and the patches of it that a view
// sees.

#include "scene/view.hpp"
#include "streaming/streamer.hpp"
#include "streaming/terrain_cut.hpp"

#include <glm/vec4.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace paradize {

/// How much of the terrain a frame draws.
struct TerrainCounts {
    std::uint32_t patches = 0;     // drawn in the main view
    std::uint64_t triangles = 0;   // of them
    std::uint32_t cut_patches = 0; // of the frame's cut, seen or not
    std::uint64_t cut_triangles = 0;
    std::uint32_t resident_patches = 0; // patches that are on the device
    std::uint32_t total_patches = 0;    // patches of the scene
};

/// A plane that keeps everything.
inline constexpr glm::vec4 no_plane{0.0F, 0.0F, 0.0F, 1.0F};

/// Uniforms of the program that draws; -1: it has none such.
struct TerrainUniforms {
    int model = -1;   // mat4, world from mesh
    int normals = -1; // mat3, of normals
};

class TerrainTiles {
  public:
    /// All outlive it.
    TerrainTiles(const assets::Terrain &terrain, const Streamer &streamer);

    /// Takes what has arrived, and finds the cut for the eye of the main view; all views of the frame share
    /// it, so that shadows and reflections fit. Allocates nothing, nor do the others.
    void update(const View &main, float error_px);
    const TerrainCut &cut() const { return cut_; }
    /// Is any of the patch in the view, and on the kept side of `plane` (in the view's coordinates, inward)?
    bool sees(const View &view, const glm::vec4 &plane, std::uint32_t patch) const;
    /// In the refraction's view, what lies below the water is drawn somewhere between its place and this
    /// height.
    void set_water(double level_m) { water_m_ = level_m; }
    /// Draws what sees() says with the program in use. Leaves a vertex array bound.
    void draw(const View &view, const glm::vec4 &plane, const TerrainUniforms &uniforms);
    TerrainCounts counts() const;

  private:
    const assets::Terrain &terrain_;
    const Streamer &streamer_;
    TerrainCut cut_;
    double water_m_ = -1e30;
    std::vector<std::uint32_t> first_patch_;    // per tile, and one more
    std::vector<std::uint32_t> known_resident_; // per tile: patches that the cut knows to have arrived
    // One draw call, as glMultiDrawElementsBaseVertex takes it.
    std::vector<int> counts_, base_vertices_;
    std::vector<const void *> offsets_;
    std::uint32_t main_patches_ = 0;
    std::uint64_t main_triangles_ = 0;
};

} // namespace paradize
