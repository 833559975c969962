#include "shader_probe.hpp"

#include "context.hpp"
#include "gl/buffer.hpp"
#include "gl/shader_library.hpp"
#include "gl/texture.hpp"
#include "gl/uniform_check.hpp"

#include <epoxy/gl.h>
#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec4.hpp>

#include <array>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace paradize::test {

doctest::Approx within(double wanted, double share) {
    return doctest::Approx(wanted).epsilon(share).scale(0.0);
}

const std::string covering_vertex =
    "#include \"lib/fullscreen.glsl\"\n"
    "void main() { gl_Position = vec4(fullscreen_corner(gl_VertexID), 0.0, 1.0); }\n";

ShaderProbe::ShaderProbe(int side_px, const std::string &fragment)
    : ShaderProbe(side_px, covering_vertex, fragment) {}

ShaderProbe::ShaderProbe(int side_px, const std::string &vertex, const std::string &fragment,
                         std::initializer_list<std::string_view> defines)
    : side_px_(side_px), target_(gl::make_target(GL_RGBA32F, side_px, side_px)),
      framebuffer_(gl::make_framebuffer(target_, {})) {
    for (const auto &entry : std::filesystem::directory_iterator(gl::ShaderLibrary::find())) {
        std::filesystem::create_symlink(std::filesystem::absolute(entry.path()),
                                        folder_.path() / entry.path().filename());
    }
    const auto file = [&](const std::string &stage, const char *own) {
        if (stage.find('\n') == std::string::npos) {
            return stage;
        }
        folder_.write(own, stage);
        return std::string(own);
    };
    const std::string vertex_file = file(vertex, "probe.vert"), fragment_file = file(fragment, "probe.frag");
    program_.emplace(gl::ShaderLibrary(folder_.path()), vertex_file, fragment_file, defines);
}

const gl::Program &ShaderProbe::use() {
    program_->use();
    return *program_;
}

void ShaderProbe::set(const char *name, std::initializer_list<float> value) {
    const int at = use().location(name);
    const std::array set_many{glUniform1fv, glUniform2fv, glUniform3fv, glUniform4fv};
    set_many.at(value.size() - 1)(at, 1, value.begin());
}

void ShaderProbe::set_int(const char *name, int value) {
    glUniform1i(use().location(name), value);
}

void ShaderProbe::set_texture(const char *name, unsigned unit, unsigned target, const gl::Texture &texture) {
    set_int(name, static_cast<int>(unit));
    gl::bind_texture(unit, target, texture.name());
}

void ShaderProbe::set_frame(const gl::FrameUniforms &frame) {
    if (!frame_) {
        frame_ = gl::make_buffer(GL_UNIFORM_BUFFER, sizeof(frame), gl::Usage::streamed);
    }
    gl::write_buffer(GL_UNIFORM_BUFFER, frame_, 0, std::as_bytes(std::span(&frame, 1)));
    glBindBufferBase(GL_UNIFORM_BUFFER, gl::frame_uniforms_binding, frame_.name());
}

std::vector<float> ShaderProbe::draw() {
    return draw(GL_TRIANGLES, 0, 3);
}

std::vector<float> ShaderProbe::draw(unsigned mode, int first, int count) {
    gl::bind_framebuffer(framebuffer_.name(), side_px_, side_px_);
    const std::array<float, 4> nothing{};
    glClearBufferfv(GL_COLOR, 0, nothing.data());
    glBindVertexArray(empty_.name());
    glDisable(GL_DEPTH_TEST);
    program_->use();
    gl::find_marked_uniforms();
    glDrawArrays(mode, first, count);
    std::vector<float> pixels(std::size_t{4} * static_cast<std::size_t>(side_px_ * side_px_));
    glReadPixels(0, 0, side_px_, side_px_, GL_RGBA, GL_FLOAT, pixels.data());
    throw_on_error();
    return pixels;
}

gl::FrameUniforms plain_frame(int side_px) {
    const auto side = static_cast<float>(side_px);
    gl::FrameUniforms frame{};
    frame.view_projection = frame.view = frame.inverse_view_projection = frame.shadow_from_world =
        glm::mat4(1.0F);
    frame.eye = {0.0F, 1.0F, 0.0F, 1.0F};
    frame.clip_plane = {0.0F, 0.0F, 0.0F, 1.0F};
    frame.viewport = {side, side, 1.0F / side, 1.0F / side};
    frame.lens = {0.5F, 1000.0F, side, 0.0F};
    frame.sun_direction = {0.0F, 1.0F, 0.0F, 0.005F};
    frame.water.w = -1e9F;
    frame.clock.z = 1.0F;
    return frame;
}

gl::Texture float_texture(int width_px, int height_px, const std::vector<float> &pixels) {
    gl::Texture texture = gl::make_target(GL_RGBA32F, width_px, height_px);
    gl::write_target(texture, width_px, height_px, pixels);
    return texture;
}

gl::Texture one_color(float r, float g, float b, float a) {
    return float_texture(1, 1, {r, g, b, a});
}

gl::Texture float_cube(int edge_px, const std::function<glm::vec3(const glm::vec3 &)> &radiance) {
    gl::Texture cube = gl::make_cube_target(GL_RGBA32F, edge_px);
    glBindTexture(GL_TEXTURE_CUBE_MAP, cube.name());
    for (unsigned face = 0; face < 6; ++face) {
        std::vector<float> pixels;
        for (int row = 0; row < edge_px; ++row) {
            for (int column = 0; column < edge_px; ++column) {
                const auto edge = static_cast<float>(edge_px);
                const float s = (2.0F * static_cast<float>(column) + 1.0F) / edge - 1.0F;
                const float t = (2.0F * static_cast<float>(row) + 1.0F) / edge - 1.0F;
                // The OpenGL Graphics System, version 3.3, table 3.21.
                const std::array<glm::vec3, 6> to{
                    {{1, -t, -s}, {-1, -t, s}, {s, 1, t}, {s, -1, -t}, {s, -t, 1}, {-s, -t, -1}}};
                const glm::vec3 color = radiance(glm::normalize(to.at(face)));
                pixels.insert(pixels.end(), {color.r, color.g, color.b, 1.0F});
            }
        }
        glTexSubImage2D(GL_TEXTURE_CUBE_MAP_POSITIVE_X + face, 0, 0, 0, edge_px, edge_px, GL_RGBA, GL_FLOAT,
                        pixels.data());
    }
    gl::make_cube_mips(cube);
    return cube;
}

} // namespace paradize::test
