#pragma once
// Which patches of the terrain are drawn: a cut through its tree of right triangles. Knows no GL.

#include "assets/scene_file.hpp"

#include <glm/vec3.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace paradize {

/// What a cut is for: the eye of the picture, whatever view is drawn.
struct CutEye {
    glm::vec3 position{0.0F};  // world, metres
    float pixels_at_1m = 1.0F; // pixels that one metre covers at a distance of one metre
    float near_m = 0.1F;       // no distance counts as smaller
    float error_px = 1.0F;     // accepted, pixels
};

/// P. Cignoni, F. Ganovelli, E. Gobbetti, F. Marton, F. Ponchio, R. Scopigno, "BDAM - Batched Dynamic
/// Adaptive Meshes for High Performance Terrain Visualization", 2003: patches that share a hypotenuse (a
/// diamond) are replaced together, so that neighbours always share whole edges.
class TerrainCut {
  public:
    /// Both outlive the cut; the reader of scene.json has checked them. Allocates all that it ever needs.
    TerrainCut(const assets::TerrainPatches &patches, const assets::TerrainDiamonds &diamonds);

    /// The patch can be drawn from now on. Once for each.
    void mark_resident(std::uint32_t patch);

    /// Finds the cut of an eye; its cost is that of the patches in it. A diamond is split when all that made
    /// its patches are split, all patches that it makes have arrived, and its error is seen. Allocates
    /// nothing.
    void update(const CutEye &eye);

    /// The cut's patches that have arrived, in rising order: every place of the terrain lies in one of them,
    /// as soon as the roots have arrived.
    std::span<const std::uint32_t> patches() const { return cut_; }
    bool split(std::uint32_t diamond) const { return split_[diamond] != 0; }
    std::uint32_t resident_count() const { return resident_count_; }

  private:
    bool wants_split(std::uint32_t diamond, const CutEye &eye) const;

    const assets::TerrainPatches &patches_;
    const assets::TerrainDiamonds &diamonds_;
    // Patches by the diamond that makes them; those of diamond d begin at first_child_[d].
    std::vector<std::uint32_t> children_, first_child_;
    std::vector<std::uint32_t> roots_;
    std::vector<std::uint8_t> patch_count_; // per diamond: patches that it replaces, 1 or 2
    std::vector<std::uint8_t>
        missing_children_;                  // per diamond: patches that it makes and that have not arrived
    std::vector<std::uint8_t> is_resident_; // per patch: it has arrived
    std::uint32_t resident_count_ = 0;
    // Of the cut that was found last.
    std::vector<std::uint8_t> split_;         // per diamond
    std::vector<std::uint8_t> reached_count_; // per diamond: patches of it that a split, or the root, shows
    std::vector<std::uint32_t> reached_;      // those patches
    std::vector<std::uint32_t> cut_;
};

} // namespace paradize
