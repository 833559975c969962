#pragma once
// The multisampled target of the main view, and how its samples become one picture.

#include "gl/handle.hpp"
#include "gl/program.hpp"

namespace paradize {

namespace gl {
class ShaderLibrary;
}
class Frame;

class MainTarget {
  public:
    explicit MainTarget(const gl::ShaderLibrary &shaders) : shaders_(&shaders) {}

    /// Creates RGBA16F with depth and stencil. `samples` is limited to what the device has; 0: no
    /// multisampling. `tone_mapped`: samples are resolved after a tone map. Else the driver takes their mean.
    /// Throws Error.
    void make(int width_px, int height_px, int samples, bool tone_mapped);
    unsigned framebuffer() const { return framebuffer_.name(); }

    /// Draws the picture into a framebuffer of the same size. The main view's FrameUniforms are bound.
    void resolve(const Frame &frame, unsigned framebuffer) const;
    /// Copies the depth of one sample of each pixel.
    void resolve_depth(unsigned framebuffer) const;

  private:
    const gl::ShaderLibrary *shaders_;
    int width_px_ = 0, height_px_ = 0;
    gl::Texture samples_;    // colour, if resolved by the program
    gl::Renderbuffer color_; // else
    gl::Renderbuffer depth_;
    gl::Framebuffer framebuffer_;
    gl::Program program_; // of this number of samples; empty: the driver resolves
};

} // namespace paradize
