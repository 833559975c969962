#pragma once
// From linear light to the screen: exposure, glow, one tone map, one sRGB encode, a still dither.

#include "gl/handle.hpp"
#include "gl/program.hpp"
#include "passes/pass.hpp"

namespace paradize {

class PostPass : public Pass {
  public:
    explicit PostPass(const PassSetup &setup);
    void resize(int width_px, int height_px) override;
    void finish(Frame &frame) override;

  private:
    /// Draws the glow's program from one texture into a framebuffer of the glow's size.
    void draw_glow(const Frame &frame, unsigned source, unsigned framebuffer, int downsample, float step_x,
                   float step_y) const;

    gl::Program program_;
    gl::Program glow_;
    gl::Texture glow_color_[2]; // bright parts, blurred in turn
    gl::Framebuffer glow_framebuffer_[2];
    int downsampling_ = 1; // texels of the picture along an edge of one of the glow's
    int glow_width_px_ = 1, glow_height_px_ = 1;
    int glow_strength_at_ = -1, blur_step_at_ = -1, downsample_at_ = -1, exposure_at_ = -1;
};

} // namespace paradize
