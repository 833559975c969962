#include "context.hpp"
#include "files.hpp"
#include "gl/draw.hpp"
#include "gl/framebuffer.hpp"
#include "gl/program.hpp"
#include "gl/shader_library.hpp"
#include "gl/texture.hpp"
#include "streaming/terrain_tiles.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <filesystem>
#include <vector>

using namespace paradize;

TEST_CASE("swash: no wave of the shader wets sand above the height from which on patches count as dry") {
    if (!test::have_context()) {
        return;
    }
    const test::Folder folder;
    std::filesystem::create_directory_symlink(gl::ShaderLibrary::find() / "lib",
                                              std::filesystem::path(folder.path()) / "lib");
    folder.write("a.vert", "#include \"lib/fullscreen.glsl\"\n"
                           "void main() { gl_Position = vec4(fullscreen_corner(gl_VertexID), 0.0, 1.0); }\n");
    folder.write("a.frag", "#include \"lib/guard.glsl\"\n#include \"lib/swash.glsl\"\n"
                           "uniform float u_height;\nout vec4 color;\nvoid main() {\n"
                           "Swash s = swash_at(1.7 * gl_FragCoord.xy, u_height * u_swash.x, 1e-3, 1e-2);\n"
                           "color = vec4(max(s.sheet, 0.0), s.film, s.foam, 1.0); }\n");
    const gl::Program program(gl::ShaderLibrary(folder.path()), "a.vert", "a.frag");
    constexpr int side = 64;
    const gl::Texture target = gl::make_target(GL_RGBA16F, side, side);
    const gl::Framebuffer framebuffer = gl::make_framebuffer(target, {});
    const gl::VertexArray empty = gl::VertexArray::create();
    gl::bind_framebuffer(framebuffer.name(), side, side);
    glBindVertexArray(empty.name());
    glDisable(GL_DEPTH_TEST);
    program.use();
    const auto is_wet = [&](double height) { // in run-ups, at any place and moment
        glUniform1f(program.location("u_height"), static_cast<float>(height));
        std::vector<float> pixels(4UL * side * side);
        bool wet = false;
        for (int wave = 0; wave < 30 && !wet; ++wave) {
            for (const float phase : {0.0F, 0.25F, 0.5F, 0.75F}) {
                glUniform4f(program.location("u_swash"), 0.5F, static_cast<float>(wave), phase, 30.0F);
                gl::draw_vertices(GL_TRIANGLES, 3);
                glReadPixels(0, 0, side, side, GL_RGBA, GL_FLOAT, pixels.data());
                for (std::size_t i = 0; i < pixels.size(); i += 4) {
                    wet = wet || *std::max_element(&pixels[i], &pixels[i + 3]) > 0.0F;
                }
            }
        }
        return wet;
    };
    CHECK_FALSE(is_wet(highest_run_up));
    CHECK(is_wet(0.8 * highest_run_up));
    test::throw_on_error();
}
