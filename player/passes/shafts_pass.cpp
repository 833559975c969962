#include "passes/shafts_pass.hpp"

#include "gl/framebuffer.hpp"
#include "gl/texture.hpp"
#include "passes/frame.hpp"

#include <epoxy/gl.h>
#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <string>

namespace paradize {

namespace {
constexpr int shaft_rows = 120; // approximate height of the textures, whatever the picture's size
} // namespace

ShaftsPass::ShaftsPass(const PassSetup &setup) : steps_(setup.settings.shaft_steps) {
    if (steps_ == 0) {
        return;
    }
    const std::string steps = "SHAFT_STEPS " + std::to_string(steps_);
    march_ = gl::Program(setup.shaders, "fullscreen.vert", "shafts_march.frag", {steps});
    smooth_ = gl::Program(setup.shaders, "fullscreen.vert", "shafts_smooth.frag");
    add_ = gl::Program(setup.shaders, "fullscreen.vert", "shafts_add.frag");
    march_.set_unit("u_depth", unit_depth);
    march_.set_unit("u_shadow_map", unit_shadow_map);
    downsample_location_ = march_.location("u_downsample");
    density_location_ = march_.location("u_density");
    anisotropy_location_ = march_.location("u_anisotropy");
    march_range_location_ = march_.location("u_range_m");
    smooth_.set_unit("u_shafts", unit_shafts);
    add_.set_unit("u_picture", unit_picture);
    add_.set_unit("u_depth", unit_depth);
    add_.set_unit("u_shafts", unit_shafts);
    texels_location_ = add_.location("u_texels");
    add_range_location_ = add_.location("u_range_m");
    radiance_location_ = add_.location("u_light_radiance");
}

void ShaftsPass::resize(const Frame &frame) {
    if (steps_ == 0) {
        return;
    }
    downsampling_ = std::max(1, (frame.height_px + shaft_rows / 2) / shaft_rows);
    width_px_ = std::max(1, (frame.width_px + downsampling_ - 1) / downsampling_);
    height_px_ = std::max(1, (frame.height_px + downsampling_ - 1) / downsampling_);
    for (int i = 0; i < 2; ++i) {
        texture_[i] = gl::make_target(GL_RG16F, width_px_, height_px_);
        target_[i] = gl::make_framebuffer(texture_[i], {});
    }
}

bool ShaftsPass::filters_now(const Frame &frame) const {
    const bool in_water = frame.view(ViewKind::main).eye.y < frame.water_m();
    return filters() && !in_water && frame.shared.shadow_map != nullptr && frame.daylight.shines();
}

void ShaftsPass::filter(Frame &frame) {
    const assets::LightShafts &shafts = *frame.scene.file().light_shafts;
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_CULL_FACE);
    gl::bind_texture(unit_depth, GL_TEXTURE_2D, frame.shared.depth->name());
    march_.use();
    gl::bind_texture(unit_shadow_map, GL_TEXTURE_2D_ARRAY, frame.shared.shadow_map->name());
    gl::Program::set(downsample_location_, downsampling_);
    gl::Program::set(density_location_, shafts.density_per_m);
    gl::Program::set(anisotropy_location_, shafts.anisotropy);
    gl::Program::set(march_range_location_, shafts.range_m);
    gl::bind_framebuffer(target_[0].name(), width_px_, height_px_);
    frame.draw_fullscreen();

    smooth_.use();
    gl::bind_texture(unit_shafts, GL_TEXTURE_2D, texture_[0].name());
    gl::bind_framebuffer(target_[1].name(), width_px_, height_px_);
    frame.draw_fullscreen();

    add_.use();
    gl::bind_texture(unit_picture, GL_TEXTURE_2D, frame.shared.picture->name());
    gl::bind_texture(unit_shafts, GL_TEXTURE_2D, texture_[1].name());
    gl::Program::set(texels_location_, 1.0F / static_cast<float>(downsampling_));
    gl::Program::set(add_range_location_, shafts.range_m);
    gl::Program::set(radiance_location_, frame.daylight.radiance);
    gl::bind_framebuffer(frame.filtered, frame.width_px, frame.height_px);
    frame.draw_fullscreen();
    glEnable(GL_CULL_FACE);
    glEnable(GL_DEPTH_TEST);
}

} // namespace paradize
