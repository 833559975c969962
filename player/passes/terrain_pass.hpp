#pragma once
// Draws the terrain: sand and effect map mixed by height, lit, wet at the shore, fading out under water.

#include "gl/handle.hpp"
#include "gl/program.hpp"
#include "passes/environment_bindings.hpp"
#include "passes/pass.hpp"

namespace paradize {

class TerrainPass : public Pass {
  public:
    explicit TerrainPass(const PassSetup &setup);
    void draw(const Frame &frame, const View &view) override;

  private:
    gl::Program depth_;
    gl::Program program_;
    EnvironmentBindings environment_;
    gl::Sampler repeat_sampler_; // repeats, for the sand
    // Clamps, because the effect map covers the terrain once. It has no mip bias: its coarse mips are used
    // for sharpening.
    gl::Sampler clamp_sampler_;
    int depth_model_location_ = -1;
    int has_sand_normal_location_ = -1, has_effect_location_ = -1, sand_reference_location_ = -1,
        grain_offset_location_ = -1, mix_location_ = -1, wet_location_ = -1, clip_location_ = -1,
        model_location_ = -1, normals_location_ = -1, fade_location_ = -1;
};

} // namespace paradize
