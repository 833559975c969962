#pragma once
// Draws the two textures that the water samples: reflection and refraction.

#include "gl/handle.hpp"
#include "passes/frame.hpp"
#include "passes/pass.hpp"

namespace paradize {

/// Draws one view of the frame into a half-float texture, scaled relative to the picture.
class WaterView : public Pass {
  public:
    WaterView(ViewKind kind, float scale) : kind_(kind), scale_(scale) {}
    void resize(int width_px, int height_px) override;

  protected:
    void draw_into(Frame &frame);

    gl::Texture color_; // linear HDR
    gl::Texture depth_; // window depth

  private:
    ViewKind kind_;
    float scale_;
    gl::Framebuffer framebuffer_;
    int width_px_ = 0, height_px_ = 0;
};

/// Draws what is above the water, seen by the mirrored eye.
class ReflectionPass : public WaterView {
  public:
    explicit ReflectionPass(const PassSetup &setup);
    void prepare(Frame &frame) override;
};

/// Draws what is below the water. Alpha holds the packed depth of the floor (shaders/lib/underwater.glsl).
class RefractionPass : public WaterView {
  public:
    explicit RefractionPass(const PassSetup &setup);
    void prepare(Frame &frame) override;
};

} // namespace paradize
