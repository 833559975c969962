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
    void resize(const Frame &frame) override;

  protected:
    /// Draws into the texture, or into another framebuffer of its size, with samples.
    void draw_into(Frame &frame, unsigned framebuffer = 0, int samples = 0);

    gl::Texture color_; // linear HDR
    gl::Texture depth_; // window depth

    gl::Framebuffer framebuffer_; // of both
    int width_px_ = 0, height_px_ = 0;

  private:
    ViewKind kind_;
    float scale_;
};

/// Draws what is above the water, seen by the mirrored eye.
class ReflectionPass : public WaterView {
  public:
    explicit ReflectionPass(const PassSetup &setup);
    void resize(const Frame &frame) override;
    void prepare(Frame &frame) override;

  private:
    /// A lamp is brighter than all else and smaller than a pixel of this view. Drawn with one sample its
    /// mirror image would come and go from frame to frame. Made where the scene has lamps, drawn into while
    /// one is on.
    gl::Renderbuffer sampled_color_, sampled_depth_;
    gl::Framebuffer sampled_;
    int samples_;
};

/// Draws what is below the water. Alpha holds the packed depth of the floor (shaders/lib/underwater.glsl).
class RefractionPass : public WaterView {
  public:
    explicit RefractionPass(const PassSetup &setup);
    void prepare(Frame &frame) override;
};

} // namespace paradize
