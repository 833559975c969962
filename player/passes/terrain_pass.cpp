#include "passes/terrain_pass.hpp"

#include "gl/texture.hpp"

#include <algorithm>
#include <epoxy/gl.h>

namespace paradize {

namespace {
enum Unit : unsigned { unit_sand_color, unit_sand_normal, unit_effect_color, unit_effect_normal };
// displacement of the effect map by grains at a slope of one, close to the eye
constexpr float grain_shift_m = 0.12F;
} // namespace

TerrainPass::TerrainPass(const PassSetup &setup)
    : depth_(setup.shaders, "depth.vert", "depth.frag"),
      program_(setup.shaders, "terrain.vert", "terrain.frag",
               {shadow_define(setup.settings), cascades_define(setup.settings)}),
      environment_(setup, program_),
      repeat_sampler_(gl::make_sampler(gl::Wrap::repeat, gl::Filter::mipmapped, setup.settings.anisotropy,
                                       std::nullopt, setup.settings.mip_bias)),
      clamp_sampler_(gl::make_sampler(gl::Wrap::clamp, gl::Filter::mipmapped, setup.settings.anisotropy)),
      depth_model_location_(depth_.location("u_model")),
      has_sand_normal_location_(program_.location("u_has_sand_normal")),
      has_effect_location_(program_.location("u_has_effect")),
      sand_reference_location_(program_.location("u_sand_reference_m")),
      grain_offset_location_(program_.location("u_grain_offset_uv")),
      mix_location_(program_.location("u_sand_mix")), wet_location_(program_.location("u_wet")),
      clip_location_(program_.location("u_clip_plane")), model_location_(program_.location("u_model")),
      normals_location_(program_.location("u_normal_matrix")), fade_location_(program_.location("u_fade")) {
    program_.set_unit("u_sand_color", unit_sand_color);
    program_.set_unit("u_sand_normal", unit_sand_normal);
    program_.set_unit("u_effect_color", unit_effect_color);
    program_.set_unit("u_effect_normal", unit_effect_normal);
}

void TerrainPass::draw(const Frame &frame, const View &view) {
    const assets::SceneFile &file = frame.scene.file();
    const assets::Terrain &terrain = *file.terrain;
    if (view.kind == ViewKind::light) {
        depth_.use();
        depth_bias(true);
        frame.terrain()->draw(view, no_plane, {depth_model_location_});
        depth_bias(false);
        return;
    }
    program_.use();
    environment_.apply(frame, view);
    const auto bind = [&](const std::string &name, unsigned unit, const gl::Sampler &sampler) {
        const StreamedTexture *texture = frame.scene.texture(name);
        if (texture != nullptr) {
            texture->bind(unit, sampler.name());
        }
        return texture != nullptr;
    };
    bind(terrain.sand_color, unit_sand_color, repeat_sampler_);
    const bool has_sand_normal = bind(terrain.sand_normal, unit_sand_normal, repeat_sampler_);
    const bool has_effect = bind(terrain.effect_color, unit_effect_color, clamp_sampler_) &&
                            bind(terrain.effect_normal, unit_effect_normal, clamp_sampler_);
    gl::Program::set(has_sand_normal_location_, has_sand_normal ? 1.0F : 0.0F);
    gl::Program::set(has_effect_location_, has_effect ? 1.0F : 0.0F);
    const float repeat_m = terrain.size_m.x / std::max(terrain.sand_repeat, 1e-3F);
    gl::Program::set(sand_reference_location_, 4.0F * repeat_m);
    gl::Program::set(grain_offset_location_, grain_shift_m / glm::vec2(terrain.size_m));
    gl::Program::set(mix_location_,
                     glm::vec4(terrain.mix_low_m, terrain.mix_high_m, terrain.specular, terrain.smoothness));
    gl::Program::set(wet_location_,
                     glm::vec3(terrain.wet_high_m, terrain.wet_darkness, terrain.wet_smoothness));

    // The refraction texture shows the sea floor, so the main view does not draw it again.
    const bool clipped_at_water = view.kind == ViewKind::main && frame.shared.refraction != nullptr &&
                                  file.water && view.eye.y > frame.water_m();
    glm::vec4 plane = view.clipped ? view.clip_plane : no_plane;
    if (clipped_at_water) {
        glEnable(GL_CLIP_DISTANCE0);
        plane = glm::vec4(0.0F, 1.0F, 0.0F, 0.3F - frame.water_m());
    }
    // The refraction view reaches 1 m up the beach, so that its coarser pixels leave no gap at the shore.
    if (view.kind == ViewKind::refraction && file.water) {
        plane = glm::vec4(0.0F, -1.0F, 0.0F, frame.water_m() + 1.0F);
    }
    gl::Program::set(clip_location_, plane);
    frame.terrain()->draw(view, plane, {model_location_, normals_location_, fade_location_});
    if (clipped_at_water) {
        glDisable(GL_CLIP_DISTANCE0);
    }
}

} // namespace paradize
