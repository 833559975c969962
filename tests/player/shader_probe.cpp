#include "shader_probe.hpp"

#include "context.hpp"
#include "gl/draw.hpp"
#include "gl/shader_library.hpp"
#include "gl/texture.hpp"

#include <epoxy/gl.h>

#include <filesystem>

namespace paradize::test {

ShaderProbe::ShaderProbe(int side_px, const std::string &fragment)
    : side_px_(side_px), target_(gl::make_target(GL_RGBA32F, side_px, side_px)),
      framebuffer_(gl::make_framebuffer(target_, {})) {
    std::filesystem::create_directory_symlink(gl::ShaderLibrary::find() / "lib",
                                              std::filesystem::path(folder_.path()) / "lib");
    folder_.write(
        "a.vert",
        std::string("#include \"lib/fullscreen.glsl\"\n"
                    "void main() { gl_Position = vec4(fullscreen_corner(gl_VertexID), 0.0, 1.0); }\n"));
    folder_.write("a.frag", fragment);
    program_.emplace(gl::ShaderLibrary(folder_.path()), "a.vert", "a.frag");
}

const gl::Program &ShaderProbe::use() {
    program_->use();
    return *program_;
}

std::vector<float> ShaderProbe::draw() {
    gl::bind_framebuffer(framebuffer_.name(), side_px_, side_px_);
    glBindVertexArray(empty_.name());
    glDisable(GL_DEPTH_TEST);
    program_->use();
    gl::draw_vertices(GL_TRIANGLES, 3);
    std::vector<float> pixels(std::size_t{4} * static_cast<std::size_t>(side_px_ * side_px_));
    glReadPixels(0, 0, side_px_, side_px_, GL_RGBA, GL_FLOAT, pixels.data());
    throw_on_error();
    return pixels;
}

} // namespace paradize::test
