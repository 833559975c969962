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
    /// `tone_mapped`: a tone map follows, so samples are resolved with weights that fall with brightness.
    /// Else the driver takes their mean.
    MainTarget(const gl::ShaderLibrary &shaders, bool tone_mapped)
        : shaders_(&shaders), tone_mapped_(tone_mapped) {}

    /// Creates RGBA16F with depth. `samples` is limited to what the device has; 0: no multisampling. Throws
    /// Error.
    void make(int width_px, int height_px, int samples);
    unsigned framebuffer() const { return framebuffer_.name(); }

    /// Draws the picture into a framebuffer of the same size. The main view's FrameUniforms are bound.
    void resolve(const Frame &frame, unsigned framebuffer) const;
    /// Copies the depth of one sample of each pixel.
    void resolve_depth(unsigned framebuffer) const;

  private:
    const gl::ShaderLibrary *shaders_;
    bool tone_mapped_;
    int width_px_ = 0, height_px_ = 0;
    gl::Texture samples_;    // colour, if resolved by the program
    gl::Renderbuffer color_; // else
    gl::Renderbuffer depth_;
    gl::Framebuffer framebuffer_;
    gl::Program program_; // of this number of samples; empty: the driver resolves
};

} // namespace paradize
