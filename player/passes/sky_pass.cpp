#include "passes/sky_pass.hpp"

#include <epoxy/gl.h>

namespace paradize {

SkyPass::SkyPass(const PassSetup &setup)
    : program_(setup.shaders, "sky.vert", "sky.frag"), environment_(setup, program_) {}

void SkyPass::draw(const Frame &frame, const View &view) {
    if (view.kind != ViewKind::main && view.kind != ViewKind::mirror) {
        return;
    }
    program_.use();
    environment_.apply(frame, view);
    glDepthFunc(GL_LEQUAL); // the sky is drawn at the far plane, where depth is 1
    glDepthMask(GL_FALSE);
    glDisable(GL_CULL_FACE);
    frame.draw_fullscreen();
    glEnable(GL_CULL_FACE);
    glDepthMask(GL_TRUE);
    glDepthFunc(GL_LESS);
}

} // namespace paradize
