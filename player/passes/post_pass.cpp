#include "passes/post_pass.hpp"

#include "frame.hpp"
#include "gl/framebuffer.hpp"
#include "gl/texture.hpp"

#include <epoxy/gl.h>

namespace paradize {

namespace {
constexpr int unit_picture = 0;
}

PostPass::PostPass(const PassSetup &setup) : program_(setup.shaders, "fullscreen.vert", "post.frag") {
    program_.set_unit("u_picture", unit_picture);
}

void PostPass::finish(Frame &frame) {
    gl::bind_framebuffer(frame.output, frame.width_px, frame.height_px);
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_CULL_FACE);
    program_.use();
    gl::bind_texture(unit_picture, GL_TEXTURE_2D, frame.shared.picture->name());
    frame.draw_fullscreen();
    glEnable(GL_CULL_FACE);
    glEnable(GL_DEPTH_TEST);
}

} // namespace paradize
