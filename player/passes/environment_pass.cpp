#include "passes/environment_pass.hpp"

#include "gl/framebuffer.hpp"
#include "gl/texture.hpp"
#include "passes/environment_bindings.hpp"

#include <epoxy/gl.h>

#include <glm/mat3x3.hpp>

#include <cmath>

namespace paradize {

namespace {

// The light of the surroundings changes in steps too small to be seen, so that most frames draw no
// environment.
constexpr double steps_per_s = 10.0;

/// From (s, t, 1) on each face, in [-1, 1], to a direction: The Khronos Group, "The OpenGL Graphics System",
/// version 3.3, table 3.21.
const std::array<glm::mat3, 6> face_axes{{
    {0, 0, -1, 0, -1, 0, 1, 0, 0},
    {0, 0, 1, 0, -1, 0, -1, 0, 0},
    {1, 0, 0, 0, 0, 1, 0, 1, 0},
    {1, 0, 0, 0, 0, -1, 0, -1, 0},
    {1, 0, 0, 0, -1, 0, 0, 0, 1},
    {-1, 0, 0, 0, -1, 0, 0, 0, -1},
}};

/// Says which of the sky's textures are resident, and how fine.
std::uint64_t levels_of(const Scene &scene, const SkyBlend &sky) {
    const assets::SceneFile &file = scene.file();
    std::uint64_t out = 1;
    for (const std::size_t key : sky.key) {
        out = out * 64 + static_cast<std::uint64_t>(scene.texture(file.daytime[key].sky)->finest());
    }
    return file.clouds ? out * 64 + static_cast<std::uint64_t>(scene.texture(file.clouds->map)->finest())
                       : out;
}

} // namespace

EnvironmentPass::EnvironmentPass(const PassSetup &setup)
    : program_(setup.shaders, "fullscreen.vert", "environment.frag"), bindings_(program_),
      cube_(gl::make_cube_target(GL_RGBA16F, environment_px)), face_location_(program_.location("u_face")),
      pixels_location_(program_.location("u_pixels_per_rad")) {
    for (int face = 0; face < faces; ++face) {
        framebuffers_[static_cast<std::size_t>(face)] = gl::make_face_framebuffer(cube_, face);
    }
}

void EnvironmentPass::prepare(Frame &frame) {
    frame.shared.environment = &cube_;
    const double second = std::floor(frame.clock.flight_s * steps_per_s) / steps_per_s;
    const Daylight daylight = daylight_at(frame.scene.file(), second);
    const std::uint64_t levels = levels_of(frame.scene, daylight.sky);
    if (second == drawn_s_ && levels == drawn_levels_) {
        return;
    }
    drawn_s_ = second;
    drawn_levels_ = levels;
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_CULL_FACE);
    program_.use();
    bindings_.apply(frame.scene, daylight);
    gl::Program::set(pixels_location_, 0.5F * static_cast<float>(environment_px));
    for (std::size_t face = 0; face < framebuffers_.size(); ++face) {
        gl::bind_framebuffer(framebuffers_[face].name(), environment_px, environment_px);
        gl::Program::set(face_location_, face_axes[face]);
        frame.draw_fullscreen();
    }
    gl::make_cube_mips(cube_);
    glEnable(GL_CULL_FACE);
    glEnable(GL_DEPTH_TEST);
}

} // namespace paradize
