#include "passes/sky_pass.hpp"

#include <epoxy/gl.h>

namespace paradize {

SkyPass::SkyPass(const PassSetup &setup)
    : program_(setup.shaders, "sky.vert", "sky.frag"), environment_(setup, program_),
      max_radiance_at_(program_.location("u_limit")) {}

void SkyPass::draw(const Frame &frame, const View &view) {
    if (view.kind != ViewKind::main && view.kind != ViewKind::mirror) {
        return;
    }
    program_.use();
    environment_.apply(frame, view);
    // The water draws the sun's glitter itself: in the mirror the disc is cut to a bright sky.
    gl::Program::set(max_radiance_at_, view.kind == ViewKind::mirror ? 8.0F : 60.0F);
    glDepthFunc(GL_LEQUAL); // it lies upon the far plane, where depth was cleared to
    glDepthMask(GL_FALSE);
    glDisable(GL_CULL_FACE);
    frame.draw_fullscreen();
    glEnable(GL_CULL_FACE);
    glDepthMask(GL_TRUE);
    glDepthFunc(GL_LESS);
}

} // namespace paradize
