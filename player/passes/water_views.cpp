#include "passes/water_views.hpp"

#include "gl/framebuffer.hpp"
#include "gl/texture.hpp"
#include "scene/camera.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>

namespace paradize {

void WaterView::resize(const Frame &frame) {
    width_px_ = scaled_px(frame.width_px, scale_);
    height_px_ = scaled_px(frame.height_px, scale_);
    color_ = gl::make_target(GL_RGBA16F, width_px_, height_px_);
    depth_ = gl::make_target(GL_DEPTH_COMPONENT24, width_px_, height_px_);
    framebuffer_ = gl::make_framebuffer(color_, depth_);
}

void WaterView::draw_into(Frame &frame, unsigned framebuffer, int samples) {
    View view = frame.view(kind_);
    view.width_px = width_px_;
    view.height_px = height_px_;
    view.samples = samples;
    frame.draw_view(view, framebuffer != 0 ? framebuffer : framebuffer_.name());
}

namespace {

/// Samples a pixel while a lamp is on; not in quality `fast`, whose mirror is smaller than the scene's.
int samples_of(const PassSetup &setup) {
    const assets::SceneFile &file = setup.scene.file();
    const bool is_fast = setup.settings.reflection_scale < file.reflection_scale.value_or(1.0F);
    return file.lights.empty() || is_fast ? 0 : setup.settings.samples;
}

} // namespace

ReflectionPass::ReflectionPass(const PassSetup &setup)
    : WaterView(ViewKind::mirror, setup.settings.reflection_scale), samples_(samples_of(setup)) {}

void ReflectionPass::resize(const Frame &frame) {
    WaterView::resize(frame);
    GLint most = 1;
    glGetIntegerv(GL_MAX_SAMPLES, &most);
    if (const int samples = std::min(samples_, most); samples > 1) {
        sampled_color_ = gl::make_renderbuffer(GL_RGBA16F, width_px_, height_px_, samples);
        sampled_depth_ = gl::make_renderbuffer(GL_DEPTH24_STENCIL8, width_px_, height_px_, samples);
        sampled_ = gl::make_framebuffer(sampled_color_, sampled_depth_);
    }
}

void ReflectionPass::prepare(Frame &frame) {
    const assets::SceneFile &file = frame.scene.file();
    if (file.water && frame.view(ViewKind::main).eye.y <= frame.water_m()) {
        return; // below the surface there is no reflection from above
    }
    const bool lamps_on =
        std::ranges::any_of(frame.point_lights.strengths(), [](float s) { return s > 0.0F; });
    if (sampled_ && lamps_on) {
        draw_into(frame, sampled_.name(), samples_);
        gl::blit_color(sampled_.name(), width_px_, height_px_, framebuffer_.name(), width_px_, height_px_);
    } else {
        draw_into(frame);
    }
    frame.shared.reflection = &color_;
}

RefractionPass::RefractionPass(const PassSetup &setup)
    : WaterView(ViewKind::refraction, setup.settings.refraction_scale) {}

void RefractionPass::prepare(Frame &frame) {
    const assets::SceneFile &file = frame.scene.file();
    if (file.water && frame.view(ViewKind::main).eye.y <= frame.water_m()) {
        return;
    }
    draw_into(frame);
    frame.shared.refraction = &color_;
    frame.shared.refraction_depth = &depth_;
}

} // namespace paradize
