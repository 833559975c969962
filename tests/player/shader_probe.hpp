#pragma once
// Calls a function of shaders/lib, or runs a shader of shaders/, for each pixel of a square, to compare it
// with a reference.

#include "files.hpp"
#include "gl/frame_uniforms.hpp"
#include "gl/framebuffer.hpp"
#include "gl/handle.hpp"
#include "gl/program.hpp"

#include <doctest/doctest.h>
#include <glm/vec3.hpp>

#include <functional>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace paradize::test {

/// Needs the context of have_context().
class ShaderProbe {
  public:
    /// fragment: the text of a fragment shader; its includes are those of shaders/.
    ShaderProbe(int side_px, const std::string &fragment);
    /// vertex, fragment: the name of a file of shaders/, as "sky.frag", or the text of a shader.
    ShaderProbe(int side_px, const std::string &vertex, const std::string &fragment,
                std::initializer_list<std::string_view> defines = {});

    /// Makes the shader's program the current one, for its uniforms.
    const gl::Program &use();
    /// Sets a uniform of one to four floats. A uniform that the shader does not use is ignored.
    void set(const char *name, std::initializer_list<float> value);
    void set_int(const char *name, int value);
    void set_texture(const char *name, unsigned unit, unsigned target, const gl::Texture &texture);
    /// Fills the block that all views share.
    void set_frame(const gl::FrameUniforms &frame);

    /// Draws, and returns four floats for each pixel, the first row at the bottom.
    std::vector<float> draw();
    /// Draws `count` vertices from `first` on, as GL_TRIANGLE_STRIP or GL_POINTS. Pixels beside them are 0.
    std::vector<float> draw(unsigned mode, int first, int count);

  private:
    Folder folder_;
    int side_px_;
    std::optional<gl::Program> program_;
    gl::Texture target_;
    gl::Framebuffer framebuffer_;
    gl::VertexArray empty_ = gl::VertexArray::create();
    gl::Buffer frame_;
};

/// Equal to `wanted`, which is not 0, but for so large a share of it. (doctest::Approx takes a share of 1 and
/// more.)
doctest::Approx within(double wanted, double share);

/// A vertex shader that covers the square.
extern const std::string covering_vertex;

/// A view from 1 m above the origin, at noon, without sun, sky, haze and water; all else is 0 or off.
gl::FrameUniforms plain_frame(int side_px);

/// A texture of full floats without mips; pixels: four floats each, first row at the bottom.
gl::Texture float_texture(int width_px, int height_px, const std::vector<float> &pixels);
/// A texture of one texel.
gl::Texture one_color(float r, float g, float b, float a);
/// A cube map of full floats with all its mips: the radiance in each direction.
gl::Texture float_cube(int edge_px, const std::function<glm::vec3(const glm::vec3 &)> &radiance);

} // namespace paradize::test
