#pragma once
// Chooses the terrain patches to draw: a cut through a tree of right triangles. Uses no GL.

#include "assets/scene_file.hpp"

#include <glm/vec3.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace paradize {

/// The eye that the cut is found for. All views use the main view's eye.
struct CutEye {
    glm::vec3 position{0.0F};  // world, metres
    float pixels_at_1m = 1.0F; // pixels per metre at a distance of one metre
    float near_m = 0.1F;       // lower limit of the distance
    float error_px = 1.0F;     // accepted error, pixels
};

/// A cut through the patches. Patches that share a hypotenuse (a diamond) are split together, so that
/// neighbouring patches always share whole edges: P. Cignoni, F. Ganovelli, E. Gobbetti, F. Marton, F.
/// Ponchio, R. Scopigno, "BDAM - Batched Dynamic Adaptive Meshes for High Performance Terrain Visualization",
/// 2003.
class TerrainCut {
  public:
    /// Both must outlive the cut and be valid; the reader of scene.json has checked them. Allocates all
    /// memory.
    TerrainCut(const assets::TerrainPatches &patches, const assets::TerrainDiamonds &diamonds);

    /// Says that the patch is resident, or no longer. At first no patch is.
    void mark_resident(std::uint32_t patch);
    void mark_absent(std::uint32_t patch);

    /// Finds the cut for an eye, in time proportional to its size. A diamond is split if all diamonds above
    /// it are split, its child patches are resident and its error is visible. Allocates nothing.
    void update(const CutEye &eye);

    /// The resident patches of the cut, ascending. Once the roots are resident they cover the whole terrain.
    std::span<const std::uint32_t> patches() const { return cut_; }
    bool split(std::uint32_t diamond) const { return split_[diamond] != 0; }
    std::uint32_t resident_count() const { return resident_count_; }

  private:
    bool wants_split(std::uint32_t diamond, const CutEye &eye) const;

    const assets::TerrainPatches &patches_;
    const assets::TerrainDiamonds &diamonds_;
    // Patches by parent diamond. Those of diamond d start at first_child_[d].
    std::vector<std::uint32_t> children_, first_child_;
    std::vector<std::uint32_t> roots_;
    std::vector<std::uint8_t> patch_count_;      // per diamond: the patches that it replaces, 1 or 2
    std::vector<std::uint8_t> missing_children_; // per diamond: children that are not resident yet
    std::vector<std::uint8_t> is_resident_;      // per patch
    std::uint32_t resident_count_ = 0;
    // The last cut.
    std::vector<std::uint8_t> split_; // per diamond
    // per diamond: its patches that are roots or children of a split diamond
    std::vector<std::uint8_t> reached_count_;
    std::vector<std::uint32_t> reached_; // these patches
    std::vector<std::uint32_t> cut_;
};

} // namespace paradize
