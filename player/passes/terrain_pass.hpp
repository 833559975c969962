#pragma once
// Draws the terrain: sand and effect map mixed by height, lit, wet at the shore, fading out under water.

#include "gl/handle.hpp"
#include "gl/program.hpp"
#include "passes/environment_bindings.hpp"
#include "passes/pass.hpp"
#include "streaming/terrain_tiles.hpp"

#include <array>
#include <vector>

namespace paradize {

class TerrainPass : public Pass {
  public:
    explicit TerrainPass(const PassSetup &setup);
    void draw(const Frame &frame, const View &view) override;

  private:
    enum Unit : unsigned {
        unit_sand_color,
        unit_sand_normal,
        unit_effect_color,
        unit_effect_normal,
        unit_reflection
    };
    /// A variant of the program for the patches of a kind, so that none computes what it does not need:
    /// software rasterisers run both sides of every branch.
    struct Lit {
        Lit(const PassSetup &setup, PatchKind drawn_kind, bool point_lights, bool views_above);

        PatchKind kind;
        bool by_lights;   // for patches that point lights reach
        bool above_water; // for views that show nothing under water (Frame::hides_under_water)
        gl::Program program;
        EnvironmentBindings environment;
        int sand_reference, grain_offset, mix, wet, has_reflection, clip;
        TerrainUniforms uniforms;
    };
    static void set_uniforms(const Lit &lit, const assets::Terrain &terrain);

    gl::Program depth_;
    std::vector<Lit> lit_; // of the kinds that the terrain has, and again where point lights reach it
    std::array<bool, patch_kinds> has_above_{}; // by PatchKind: there are programs for those views
    gl::Sampler repeat_sampler_;                // repeats, for the sand
    // Clamps, because the effect map covers the terrain once. It has no mip bias: its coarse mips are used
    // for sharpening.
    gl::Sampler clamp_sampler_;
    gl::Sampler reflection_sampler_;
    int depth_model_location_ = -1;
};

} // namespace paradize
