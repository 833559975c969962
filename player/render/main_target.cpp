#include "render/main_target.hpp"

#include "gl/framebuffer.hpp"
#include "gl/texture.hpp"
#include "passes/frame.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <string>

namespace paradize {

namespace {

int limit(unsigned name) {
    GLint most = 1;
    glGetIntegerv(name, &most);
    return most;
}

} // namespace

void MainTarget::make(int width_px, int height_px, int samples, bool tone_mapped) {
    width_px_ = width_px;
    height_px_ = height_px;
    samples_ = {};
    color_ = {};
    program_ = {};
    samples = std::min(samples, limit(GL_MAX_SAMPLES));
    if (tone_mapped && samples > 1) {
        samples = std::min(samples, limit(GL_MAX_COLOR_TEXTURE_SAMPLES));
        samples_ = gl::make_multisample_target(GL_RGBA16F, width_px, height_px, samples);
        program_ =
            gl::Program(*shaders_, "fullscreen.vert", "resolve.frag", {"SAMPLES " + std::to_string(samples)});
        program_.set_unit("u_samples", 0);
    } else {
        color_ = gl::make_renderbuffer(GL_RGBA16F, width_px, height_px, samples);
    }
    depth_ = gl::make_renderbuffer(GL_DEPTH24_STENCIL8, width_px, height_px, samples);
    framebuffer_ =
        samples_ ? gl::make_multisample_framebuffer(samples_, depth_) : gl::make_framebuffer(color_, depth_);
}

void MainTarget::resolve(const Frame &frame, unsigned framebuffer) const {
    if (!program_) {
        gl::blit_color(framebuffer_.name(), width_px_, height_px_, framebuffer, width_px_, height_px_);
        return;
    }
    glDisable(GL_DEPTH_TEST);
    gl::bind_framebuffer(framebuffer, width_px_, height_px_);
    program_.use();
    gl::bind_texture(0, GL_TEXTURE_2D_MULTISAMPLE, samples_.name());
    frame.draw_fullscreen();
    glEnable(GL_DEPTH_TEST);
}

void MainTarget::resolve_depth(unsigned framebuffer) const {
    gl::blit_depth(framebuffer_.name(), framebuffer, width_px_, height_px_);
}

} // namespace paradize
