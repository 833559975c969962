#pragma once
// The terrain of a scene: its tiles, the cut of the frame, and the drawing of patches in a view.

#include "gl/draw.hpp"
#include "gl/handle.hpp"
#include "scene/view.hpp"
#include "streaming/streamer.hpp"
#include "streaming/terrain_cut.hpp"

#include <glm/vec4.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace paradize {

/// Terrain statistics of one frame.
struct TerrainCounts {
    std::uint32_t patches = 0;     // drawn in the main view
    std::uint64_t triangles = 0;   // of these patches
    std::uint32_t cut_patches = 0; // in the frame's cut, visible or not
    std::uint64_t cut_triangles = 0;
    std::uint32_t resident_patches = 0; // on the device
    std::uint32_t total_patches = 0;    // of the scene
};

/// A plane that clips nothing.
inline constexpr glm::vec4 no_plane{0.0F, 0.0F, 0.0F, 1.0F};

/// Uniform locations of the program that draws; -1: the program has no such uniform.
struct TerrainUniforms {
    int model = -1;   // mat4, world from mesh
    int normals = -1; // mat3, transforms normals
    int fade = -1;    // vec2, PatchFade
};

/// The data that the lighting of a patch needs. Fading patches may be of any height.
enum class PatchKind : std::uint8_t { dry, shore, sunken, fading };
inline constexpr std::size_t patch_kinds = 4;

/// Kinds of patches, one bit each, as 1 << kind.
using PatchKinds = std::uint8_t;
inline constexpr PatchKinds all_patches = (1U << patch_kinds) - 1;

/// No wave of shaders/lib/swash.glsl runs higher, in swash_height_m.
inline constexpr double highest_run_up = 1.2;

/// Returns the kind of each patch while it does not fade: `dry`, wholly above the water and the waves that
/// run up on the beach; `sunken`, wholly so far below it that it is neither wet sand nor reflects; else
/// `shore`.
std::vector<PatchKind> patch_heights(const assets::Terrain &terrain, const Streamer &streamer,
                                     const assets::Water &water);

/// The patches to draw, by the lights that reach them. `lit`: by light set, as in PointLights. Draws those
/// whose set is lit, or the others. `bind_block` is called with each block of lit sets before its patches.
struct PatchLights {
    std::span<const std::uint8_t> lit; // PointLights::lit()
    bool draws_lit = false;
    std::uint32_t sets_per_block = 1;
    std::function<void(std::uint32_t)> bind_block; // PointLights::bind_block()
};

/// Says of each diamond whether a patch of it, or of its split, meets the height of the water. Where such a
/// diamond splits the waterline moves, which is seen more than other changes: those fade.
std::vector<bool> shore_diamonds(const assets::Terrain &terrain, const Streamer &streamer, double water_m);

/// True if any part of a patch's bounding sphere is inside the view. The refraction view lifts what is below
/// the water, so it sees the sphere swept upwards to the water's height.
bool patch_in_view(const View &view, const glm::dvec3 &center, float radius_m, double water_m);

class TerrainTiles {
  public:
    /// `terrain` and `streamer` must outlive this object.
    TerrainTiles(const assets::Terrain &terrain, const Streamer &streamer);

    /// Registers which patches are resident and finds the cut for the main view's eye. All views of the frame
    /// share the cut, so that shadows and reflections fit. Allocates nothing; nor do the other functions.
    void update(const View &main, float error_px);
    const TerrainCut &cut() const { return cut_; }
    /// True if any part of the patch is inside the view and on the kept side of `plane`. The plane is in the
    /// view's coordinates and points inwards. The light, whose map is filtered and kept, sees no patch half:
    /// a patch counts if the middle dither value shows it.
    bool sees(const View &view, const glm::vec4 &plane, std::uint32_t patch) const;
    /// Sets the water level. The refraction view draws what is below the water between its true height and
    /// this level.
    void set_water(const assets::Water &water);
    /// Lists the patches of some kinds that sees() accepts, for draw(). The light sees no patch fade. lights:
    /// only some of them; nullptr: all, without lights.
    void choose(const View &view, const glm::vec4 &plane, PatchKinds kinds = all_patches,
                const PatchLights *lights = nullptr);
    /// Draws what choose() listed for this view, with the program in use. A draw call draws all patches of a
    /// page that fade alike and have the same lights. Leaves a vertex array bound.
    void draw(const View &view, const TerrainUniforms &uniforms, const PatchLights *lights = nullptr);
    TerrainCounts counts() const;

  private:
    PatchFade fade_in(const View &view, std::uint32_t patch) const;
    std::uint32_t light_set(std::uint32_t patch) const {
        return terrain_.light_sets.empty() ? 0 : terrain_.light_sets[patch];
    }
    bool is_of(PatchKinds kinds, const View &view, std::uint32_t patch) const;
    /// True if all of the patch is on the side of the plane that is not kept.
    bool is_beyond(const View &view, const glm::vec4 &plane, std::uint32_t patch) const;

    const assets::Terrain &terrain_;
    const Streamer &streamer_;
    TerrainCut cut_;
    std::vector<PatchKind> heights_;    // patch_heights()
    std::vector<glm::vec2> low_high_m_; // per patch
    double water_m_ = -1e30;
    std::vector<std::uint32_t> first_patch_;        // per tile, plus the end
    std::vector<std::vector<bool>> known_resident_; // per tile and block: what cut_ knows
    std::vector<std::uint32_t> same_model_;         // per tile: the first one with the same model
    /// A patch to draw.
    struct VisiblePatch {
        std::uint32_t patch = 0, model = 0; // model: a tile
        std::uint32_t light_block = 0;
        std::uint32_t light_set = 0; // in the block
        PatchFade fade;
        const GeometrySlot *slot = nullptr;
        const PatchRange *range = nullptr;
    };
    /// True if one draw call may draw both.
    bool joined(const VisiblePatch &a, const VisiblePatch &b) const;
    /// Draws patches that are joined, by the lights of each.
    void draw_by_lights(std::span<const VisiblePatch> patches);
    std::vector<VisiblePatch> seen_;
    // Arguments of glMultiDrawElementsBaseVertex.
    std::vector<int> counts_, base_vertices_;
    std::vector<const void *> offsets_;
    // Arguments of glMultiDrawElementsIndirect, where the device has it: an instance for each set of a block.
    gl::Buffer set_numbers_, indirect_;
    std::vector<gl::IndirectDraw> draws_;
    std::uint32_t main_patches_ = 0; // drawn since update()
    std::uint64_t main_triangles_ = 0;
};

} // namespace paradize
