#include "passes/post_pass.hpp"

#include "gl/framebuffer.hpp"
#include "gl/texture.hpp"
#include "passes/frame.hpp"

#include <epoxy/gl.h>
#include <glm/vec2.hpp>

#include <algorithm>

namespace paradize {

namespace {
constexpr int glow_rows = 180; // most rows of the glow texture; steps of its blur in a picture's height
constexpr float glow_strength = 0.22F; // share of the light of bright pixels that spreads around them
} // namespace

PostPass::PostPass(const PassSetup &setup)
    : program_(setup.shaders, "fullscreen.vert", "post.frag"),
      glow_(setup.shaders, "fullscreen.vert", "glow.frag"),
      blur_(setup.shaders, "fullscreen.vert", "glow_blur.frag"),
      glow_strength_location_(program_.location("u_glow_strength")),
      blur_step_location_(blur_.location("u_blur_step")),
      downsample_location_(glow_.location("u_downsample")), exposure_location_(glow_.location("u_exposure")) {
    program_.set_unit("u_picture", unit_picture);
    program_.set_unit("u_glow", unit_glow);
    glow_.set_unit("u_source", unit_picture);
    blur_.set_unit("u_source", unit_picture);
    if (setup.settings.render_scale < 1.0F) {
        enlarge_ = gl::Program(setup.shaders, "fullscreen.vert", "enlarge.frag");
        enlarge_.set_unit("u_picture", unit_picture);
        texels_location_ = enlarge_.location("u_texels");
        along_location_ = enlarge_.location("u_along");
    }
}

void PostPass::resize(const Frame &frame) {
    downsampling_ = std::max(1, (frame.height_px + glow_rows - 1) / glow_rows);
    glow_width_px_ = std::max(1, (frame.width_px + downsampling_ - 1) / downsampling_);
    glow_height_px_ = std::max(1, (frame.height_px + downsampling_ - 1) / downsampling_);
    for (int i = 0; i < 2; ++i) {
        glow_color_[i] = gl::make_target(GL_RGBA16F, glow_width_px_, glow_height_px_);
        glow_framebuffer_[i] = gl::make_framebuffer(glow_color_[i], {});
    }
    if (enlarge_) {
        encoded_color_ = gl::make_target(GL_RGBA8, frame.width_px, frame.height_px);
        encoded_ = gl::make_framebuffer(encoded_color_, {});
        wide_color_ = gl::make_target(GL_RGBA8, frame.output_width_px, frame.height_px);
        wide_ = gl::make_framebuffer(wide_color_, {});
    }
}

void PostPass::enlarge(const Frame &frame, const gl::Texture &source, const glm::vec2 &along,
                       float texels_per_px) const {
    gl::Program::set(along_location_, along);
    gl::Program::set(texels_location_, texels_per_px);
    gl::bind_texture(unit_picture, GL_TEXTURE_2D, source.name());
    frame.draw_fullscreen();
}

void PostPass::draw_glow(const Frame &frame, unsigned source, unsigned framebuffer) const {
    gl::bind_framebuffer(framebuffer, glow_width_px_, glow_height_px_);
    gl::bind_texture(unit_picture, GL_TEXTURE_2D, source);
    frame.draw_fullscreen();
}

void PostPass::finish(Frame &frame) {
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_CULL_FACE);

    glow_.use();
    gl::Program::set(exposure_location_, frame.daylight.exposure);
    gl::Program::set(downsample_location_, downsampling_);
    draw_glow(frame, frame.shared.picture->name(), glow_framebuffer_[0].name());

    blur_.use();
    const float step_y = 1.0F / static_cast<float>(glow_rows);
    const float step_x = step_y * static_cast<float>(frame.height_px) / static_cast<float>(frame.width_px);
    gl::Program::set(blur_step_location_, glm::vec2(step_x, 0.0F));
    draw_glow(frame, glow_color_[0].name(), glow_framebuffer_[1].name());
    gl::Program::set(blur_step_location_, glm::vec2(0.0F, step_y));
    draw_glow(frame, glow_color_[1].name(), glow_framebuffer_[0].name());

    gl::bind_framebuffer(enlarge_ ? encoded_.name() : frame.output, frame.width_px, frame.height_px);
    program_.use();
    gl::Program::set(glow_strength_location_, glow_strength);
    gl::bind_texture(unit_picture, GL_TEXTURE_2D, frame.shared.picture->name());
    gl::bind_texture(unit_glow, GL_TEXTURE_2D, glow_color_[0].name());
    frame.draw_fullscreen();

    if (enlarge_) {
        const glm::vec2 texels_per_px = glm::vec2(frame.width_px, frame.height_px) /
                                        glm::vec2(frame.output_width_px, frame.output_height_px);
        enlarge_.use();
        gl::bind_framebuffer(wide_.name(), frame.output_width_px, frame.height_px);
        enlarge(frame, encoded_color_, {1, 0}, texels_per_px.x);
        gl::bind_framebuffer(frame.output, frame.output_width_px, frame.output_height_px);
        enlarge(frame, wide_color_, {0, 1}, texels_per_px.y);
    }

    glEnable(GL_CULL_FACE);
    glEnable(GL_DEPTH_TEST);
}

} // namespace paradize
