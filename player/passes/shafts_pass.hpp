#pragma once
// Shafts of light in the air: what the air scatters towards the eye, less what stands in shadow.

#include "gl/handle.hpp"
#include "gl/program.hpp"
#include "passes/pass.hpp"

namespace paradize {

class ShaftsPass : public Pass {
  public:
    explicit ShaftsPass(const PassSetup &setup);
    void resize(const Frame &frame) override;
    bool filters() const override { return steps_ > 0; }
    bool filters_now(const Frame &frame) const override;
    void filter(Frame &frame) override;

  private:
    enum Unit : unsigned { unit_picture, unit_depth, unit_shafts, unit_shadow_map };
    int steps_ = 0; // places of the shadow map that each ray looks up; 0: nothing is drawn
    gl::Program march_, smooth_, add_;
    gl::Texture texture_[2]; // as the march writes it, and smooth
    gl::Framebuffer target_[2];
    int downsampling_ = 1; // pixels per texel along an edge
    int width_px_ = 1, height_px_ = 1;
    int downsample_location_ = -1, density_location_ = -1, anisotropy_location_ = -1,
        march_range_location_ = -1;
    int texels_location_ = -1, add_range_location_ = -1, radiance_location_ = -1;
};

} // namespace paradize
