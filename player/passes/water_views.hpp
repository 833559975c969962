#pragma once
// The two pictures that the water is made of: what it mirrors, and what lies in it.

#include "gl/handle.hpp"
#include "passes/frame.hpp"
#include "passes/pass.hpp"

namespace paradize {

/// Draws one view of the frame into a half-float texture of a share of the picture's size.
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

/// What stands above the water, seen by the eye mirrored in it.
class ReflectionPass : public WaterView {
  public:
    explicit ReflectionPass(const PassSetup &setup);
    void prepare(Frame &frame) override;
};

/// What lies below the water; alpha holds the packed depth of the floor (shaders/lib/underwater.glsl).
class RefractionPass : public WaterView {
  public:
    explicit RefractionPass(const PassSetup &setup);
    void prepare(Frame &frame) override;
};

} // namespace paradize
