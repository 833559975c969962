#include "passes/environment_pass.hpp"

#include "gl/framebuffer.hpp"
#include "gl/texture.hpp"
#include "passes/environment_bindings.hpp"

#include <epoxy/gl.h>

#include <cmath>

namespace paradize {

namespace {

// The light of the surroundings changes in steps too small to be seen, so that most frames draw no
// environment.
constexpr double steps_per_s = 10.0;

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
      cube_(gl::make_cube_target(GL_RGBA16F, environment_px)),
      strip_(gl::make_target(GL_RGBA16F, faces * environment_px, environment_px)),
      framebuffer_(gl::make_framebuffer(strip_, {})), face_location_(program_.location("u_face_px")),
      pixels_location_(program_.location("u_pixels_per_rad")) {}

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
    gl::Program::set(face_location_, static_cast<float>(environment_px));
    gl::bind_framebuffer(framebuffer_.name(), faces * environment_px, environment_px);
    frame.draw_fullscreen();
    gl::copy_faces(framebuffer_.name(), cube_, environment_px);
    gl::make_cube_mips(cube_);
    glEnable(GL_CULL_FACE);
    glEnable(GL_DEPTH_TEST);
}

} // namespace paradize
