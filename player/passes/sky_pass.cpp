#include "passes/sky_pass.hpp"

#include <epoxy/gl.h>

namespace paradize {

SkyPass::SkyPass(const PassSetup &setup)
    : program_(setup.shaders, "sky.vert", "sky.frag"), environment_(setup, program_),
      max_radiance_location_(program_.location("u_max_radiance")) {}

void SkyPass::draw(const Frame &frame, const View &view) {
    if (view.kind != ViewKind::main && view.kind != ViewKind::mirror) {
        return;
    }
    program_.use();
    environment_.apply(frame, view);
    // The water pass draws the sun's reflection itself, so the mirror view clamps the sun's disc.
    gl::Program::set(max_radiance_location_, view.kind == ViewKind::mirror ? 8.0F : 60.0F);
    glDepthFunc(GL_LEQUAL); // the sky is drawn at the far plane, where depth is 1
    glDepthMask(GL_FALSE);
    glDisable(GL_CULL_FACE);
    frame.draw_fullscreen();
    glEnable(GL_CULL_FACE);
    glDepthMask(GL_TRUE);
    glDepthFunc(GL_LESS);
}

} // namespace paradize
