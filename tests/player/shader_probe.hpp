#pragma once
// Calls a function of shaders/lib for each pixel of a square, to compare it with a reference.

#include "files.hpp"
#include "gl/framebuffer.hpp"
#include "gl/handle.hpp"
#include "gl/program.hpp"

#include <optional>
#include <string>
#include <vector>

namespace paradize::test {

/// Needs the context of have_context().
class ShaderProbe {
  public:
    /// fragment: the text of a fragment shader; its includes are those of shaders/.
    ShaderProbe(int side_px, const std::string &fragment);

    /// Makes the shader's program the current one, for its uniforms.
    const gl::Program &use();
    /// Draws, and returns four floats for each pixel, the first row at the bottom.
    std::vector<float> draw();

  private:
    Folder folder_;
    int side_px_;
    std::optional<gl::Program> program_;
    gl::Texture target_;
    gl::Framebuffer framebuffer_;
    gl::VertexArray empty_ = gl::VertexArray::create();
};

} // namespace paradize::test
