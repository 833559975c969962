#pragma once
// Chooses the terrain patches to draw: a cut through a tree of right triangles. Uses no GL.

#include "assets/scene/file.hpp"

#include <glm/vec3.hpp>

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace paradize {

/// The eye that the cut is found for. All views use the main view's eye.
struct CutEye {
    glm::vec3 position{0.0F};  // world, metres
    float pixels_at_1m = 1.0F; // pixels per metre at a distance of one metre
    float near_m = 0.1F;       // lower limit of the distance
    float error_px = 1.0F;     // accepted error, pixels
};

/// The share of pixels that show a patch: those whose dither value (0 to 1) is at least `from` and below
/// `to`. {0, 1}: all pixels.
struct PatchFade {
    float from = 0.0F, to = 1.0F;

    bool shows(float dither) const { return from <= dither && dither < to; }
    bool operator==(const PatchFade &) const = default;
};

/// A diamond that fades begins to split at this share of the accepted error, and is split at all of it.
inline constexpr float fade_begin = 0.85F;

/// A cut through the patches. For each dither value it is a cut of its own, without holes and overlaps:
/// diamonds that fade are split at a few dither values first and at all in the end. Patches that share a
/// hypotenuse (a diamond) are split together, so that neighbouring patches always share whole edges: P.
/// Cignoni, F. Ganovelli, E. Gobbetti, F. Marton, F. Ponchio, R. Scopigno, "BDAM - Batched Dynamic Adaptive
/// Meshes for High Performance Terrain Visualization", 2003.
class TerrainCut {
  public:
    /// Both must outlive the cut and be valid; the reader of scene.json has checked them. Allocates all
    /// memory.
    TerrainCut(const assets::TerrainPatches &patches, const assets::TerrainDiamonds &diamonds);

    /// Says which diamonds fade, one entry per diamond. At first none does.
    void set_fading(std::vector<bool> fading) { is_fading_ = std::move(fading); }

    /// Says that the patch is resident, or no longer. At first no patch is.
    void mark_resident(std::uint32_t patch);
    void mark_absent(std::uint32_t patch);

    /// Finds the cut for an eye, in time proportional to its size. A diamond is split if all diamonds above
    /// it are split, its child patches are resident and its error is visible; one that fades is split no
    /// further than those above it. Allocates nothing.
    void update(const CutEye &eye);

    /// The resident patches that some pixels show, ascending. Once the roots are resident they cover the
    /// whole terrain.
    std::span<const std::uint32_t> patches() const { return cut_; }
    PatchFade fade(std::uint32_t patch) const;
    bool split(std::uint32_t diamond) const { return split_[diamond] > 0.0F; }
    std::uint32_t resident_count() const { return resident_count_; }

  private:
    float wanted_split(std::uint32_t diamond, const CutEye &eye) const;

    const assets::TerrainPatches &patches_;
    const assets::TerrainDiamonds &diamonds_;
    // Patches by parent diamond. Those of diamond d start at first_child_[d].
    std::vector<std::uint32_t> children_, first_child_;
    std::vector<std::uint32_t> roots_;
    std::vector<std::uint8_t> patch_count_;      // per diamond: the patches that it replaces, 1 or 2
    std::vector<std::uint8_t> missing_children_; // per diamond: children that are not resident yet
    std::vector<std::uint8_t> is_resident_;      // per patch
    std::uint32_t resident_count_ = 0;
    std::vector<bool> is_fading_; // per diamond
    // The last cut.
    std::vector<float> split_; // per diamond: share of dither values at which it is split
    std::vector<float> limit_; // per diamond: the least share of those above it
    // per diamond: its patches that are roots or children of a split diamond
    std::vector<std::uint8_t> reached_count_;
    std::vector<std::uint32_t> reached_; // these patches
    std::vector<std::uint32_t> cut_;
};

} // namespace paradize
