#pragma once
// Converts linear light to the screen: exposure, glow, tone map, sRGB encoding and a static dither. A picture
// that was drawn smaller is then enlarged.

#include "gl/handle.hpp"
#include "gl/program.hpp"
#include "passes/pass.hpp"

#include <glm/vec2.hpp>

namespace paradize {

class PostPass : public Pass {
  public:
    explicit PostPass(const PassSetup &setup);
    void resize(const Frame &frame) override;
    void finish(Frame &frame) override;

  private:
    enum Unit : unsigned { unit_picture, unit_glow };
    /// Draws a glow from a texture into a framebuffer of the glow's size, by the program in use.
    void draw_glow(const Frame &frame, unsigned source, unsigned framebuffer) const;
    /// Enlarges a texture along x or y into a framebuffer, which is bound.
    void enlarge(const Frame &frame, const gl::Texture &source, const glm::vec2 &along,
                 float texels_per_px) const;

    gl::Program program_;
    gl::Program glow_;
    gl::Program blur_;
    gl::Program enlarge_;       // empty: the picture is drawn as large as it is shown
    gl::Texture encoded_color_; // the picture that it enlarges
    gl::Framebuffer encoded_;
    gl::Texture wide_color_; // the same, enlarged along x
    gl::Framebuffer wide_;
    gl::Texture glow_color_[2]; // bright parts; the two targets are blurred in turn
    gl::Framebuffer glow_framebuffer_[2];
    int downsampling_ = 1; // picture texels per glow texel along an edge
    int glow_width_px_ = 1, glow_height_px_ = 1;
    int glow_strength_location_ = -1, blur_step_location_ = -1, downsample_location_ = -1,
        exposure_location_ = -1, texels_location_ = -1, along_location_ = -1;
};

} // namespace paradize
