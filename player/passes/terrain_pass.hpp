#pragma once
// The ground: sand pattern and effect map mixed by height, lit, wet along the water, dissolved under it.

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
    gl::Sampler repeat_sampler_; // repeats
    gl::Sampler
        clamp_sampler_; // clamps: the effect map covers the terrain once; sharpened by its mips, which stay
    int depth_model_at_ = -1, depth_cutoff_at_ = -1;
    int has_sand_normal_at_ = -1, has_effect_at_ = -1, sand_reference_at_ = -1, grain_offset_at_ = -1,
        mix_at_ = -1, wet_at_ = -1, clip_at_ = -1, model_at_ = -1, normals_at_ = -1;
};

} // namespace paradize
