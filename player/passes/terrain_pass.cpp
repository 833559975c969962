#include "passes/terrain_pass.hpp"

#include "gl/draw.hpp"
#include "gl/texture.hpp"

#include <algorithm>
#include <array>
#include <epoxy/gl.h>
#include <string>

namespace paradize {

namespace {
// displacement of the effect map by grains at a slope of one, close to the eye
constexpr float grain_shift_m = 0.12F;

bool has_effect(const assets::Terrain &terrain) {
    return !terrain.effect_color.empty() && !terrain.effect_normal.empty();
}

/// False for the sea floor where the effect map alone covers it: up to mix_low_m, which the sea does not
/// exceed.
bool shows_sand(const assets::SceneFile &file, PatchKind kind) {
    const assets::Terrain &terrain = *file.terrain;
    return kind != PatchKind::sunken || !has_effect(terrain) ||
           static_cast<double>(terrain.mix_low_m) < file.water->level_m;
}

std::string defines_of(const PassSetup &setup, PatchKind kind, bool point_lights, bool above_water) {
    const bool matte = kind == PatchKind::sunken;
    const assets::Terrain &terrain = *setup.scene.file().terrain;
    return shadow_define(setup.settings) + "\n#define " + cascades_define(setup.settings) +
           "\n#define FADE " + (kind == PatchKind::fading ? "1" : "0") + "\n#define DRY " +
           (kind == PatchKind::dry ? "1" : "0") + "\n#define SUNKEN " + (matte ? "1" : "0") +
           "\n#define ABOVE_WATER " + (above_water ? "1" : "0") + "\n#define MATTE " + (matte ? "1" : "0") +
           "\n#define " + point_lights_define(point_lights) + "\n#define " + swash_define(setup) +
           "\n#define SAND " + (shows_sand(setup.scene.file(), kind) ? "1" : "0") + "\n#define SAND_NORMAL " +
           (terrain.sand_normal.empty() ? "0" : "1") + "\n#define EFFECT_MAP " +
           (has_effect(terrain) ? "1" : "0");
}

/// The kinds of patches that the terrain has.
std::array<bool, patch_kinds> kinds_of(const Scene &scene) {
    std::array<bool, patch_kinds> out{};
    const assets::SceneFile &file = scene.file();
    if (!file.water) {
        out[static_cast<std::size_t>(PatchKind::dry)] = true;
        return out;
    }
    for (const PatchKind kind : patch_heights(*file.terrain, scene.streamer(), *file.water)) {
        out[static_cast<std::size_t>(kind)] = true;
    }
    const std::vector<bool> fading = shore_diamonds(*file.terrain, scene.streamer(), file.water->level_m);
    out[static_cast<std::size_t>(PatchKind::fading)] = std::ranges::find(fading, true) != fading.end();
    return out;
}
void choose(const Frame &frame, const View &view, const glm::vec4 &plane, PatchKinds kinds,
            const PatchLights *lights) {
    const CpuTimer timer(frame.scene_ms);
    frame.terrain()->choose(view, plane, kinds, lights);
}
} // namespace

TerrainPass::Lit::Lit(const PassSetup &setup, PatchKind drawn_kind, bool point_lights, bool views_above)
    : kind(drawn_kind), by_lights(point_lights), above_water(views_above),
      program(setup.shaders, "terrain.vert", "terrain.frag",
              {defines_of(setup, kind, by_lights, above_water)}),
      environment(setup, program), sand_reference(program.location("u_sand_reference_m")),
      grain_offset(program.location("u_grain_offset_uv")), mix(program.location("u_sand_mix")),
      wet(program.location("u_wet")), has_reflection(program.location("u_has_reflection")),
      clip(program.location("u_clip_plane")), uniforms{program.location("u_model"),
                                                       program.location("u_normal_matrix"),
                                                       program.location("u_fade")} {
    program.set_unit("u_sand_color", unit_sand_color);
    program.set_unit("u_sand_normal", unit_sand_normal);
    program.set_unit("u_effect_color", unit_effect_color);
    program.set_unit("u_effect_normal", unit_effect_normal);
    program.set_unit("u_reflection", unit_reflection);
}

TerrainPass::TerrainPass(const PassSetup &setup)
    : depth_(setup.shaders, "depth.vert", "depth.frag"),
      repeat_sampler_(gl::make_sampler(gl::Wrap::repeat, gl::Filter::mipmapped, setup.settings.anisotropy,
                                       std::nullopt, setup.settings.mip_bias)),
      clamp_sampler_(gl::make_sampler(gl::Wrap::clamp, gl::Filter::mipmapped, setup.settings.anisotropy)),
      reflection_sampler_(gl::make_sampler(gl::Wrap::clamp, gl::Filter::linear)),
      depth_model_location_(depth_.location("u_model")) {
    const assets::Terrain &terrain = *setup.scene.file().terrain;
    const std::array<bool, patch_kinds> kinds = kinds_of(setup.scene);
    const bool has_refraction = setup.scene.file().water && setup.scene.file().refraction_scale;
    for (std::size_t i = 0; i < kinds.size(); ++i) {
        const auto kind = static_cast<PatchKind>(i);
        const bool at_water = kind == PatchKind::shore || kind == PatchKind::fading;
        for (const bool above : {false, true}) {
            if (!kinds[i] || (above && !(at_water && has_refraction))) {
                continue;
            }
            lit_.emplace_back(setup, kind, false, above);
            if (!terrain.light_sets.empty()) {
                lit_.emplace_back(setup, kind, true, above);
            }
        }
        has_above_[i] = kinds[i] && at_water && has_refraction;
    }
}

void TerrainPass::set_uniforms(const Lit &lit, const assets::Terrain &terrain) {
    const float repeat_m = terrain.size_m.x / std::max(terrain.sand_repeat, 1e-3F);
    gl::Program::set(lit.sand_reference, 4.0F * repeat_m);
    gl::Program::set(lit.grain_offset, grain_shift_m / glm::vec2(terrain.size_m));
    gl::Program::set(lit.mix,
                     glm::vec4(terrain.mix_low_m, terrain.mix_high_m, terrain.specular, terrain.smoothness));
    gl::Program::set(lit.wet, glm::vec3(terrain.wet_high_m, terrain.wet_darkness, terrain.wet_smoothness));
}

void TerrainPass::draw(const Frame &frame, const View &view) {
    const assets::SceneFile &file = frame.scene.file();
    const assets::Terrain &terrain = *file.terrain;
    if (view.kind == ViewKind::light) {
        depth_.use();
        depth_bias(true);
        choose(frame, view, no_plane, all_patches, nullptr);
        frame.terrain()->draw(view, {depth_model_location_});
        depth_bias(false);
        return;
    }
    const auto bind = [&](const std::string &name, unsigned unit, const gl::Sampler &sampler) {
        if (const StreamedTexture *texture = frame.scene.texture(name)) {
            texture->bind(unit, sampler.name());
        }
    };
    bind(terrain.sand_color, unit_sand_color, repeat_sampler_);
    bind(terrain.sand_normal, unit_sand_normal, repeat_sampler_);
    bind(terrain.effect_color, unit_effect_color, clamp_sampler_);
    bind(terrain.effect_normal, unit_effect_normal, clamp_sampler_);

    // Water on the sand mirrors what the sea mirrors.
    const gl::Texture *reflection = view.kind == ViewKind::main ? frame.shared.reflection : nullptr;
    gl::bind_texture(unit_reflection, GL_TEXTURE_2D, reflection != nullptr ? reflection->name() : 0,
                     reflection_sampler_.name());

    // The refraction texture shows the sea floor, so the main view does not draw it again.
    const bool hides_floor = frame.hides_under_water(view);
    const bool clipped_at_water = view.kind == ViewKind::main && hides_floor;
    glm::vec4 plane = view.clipped ? view.clip_plane : no_plane;
    if (clipped_at_water) {
        glEnable(GL_CLIP_DISTANCE0);
        plane = glm::vec4(0.0F, 1.0F, 0.0F, 0.3F - frame.water_m());
    }
    // The refraction view reaches 1 m up the beach, so that its coarser pixels leave no gap at the shore.
    if (view.kind == ViewKind::refraction && file.water) {
        plane = glm::vec4(0.0F, -1.0F, 0.0F, frame.water_m() + 1.0F);
    }
    const gl::LateDepthTest late(frame.tests_depth_late(view));
    const PointLights &lights = frame.point_lights;
    for (const Lit &lit : lit_) {
        const bool above = hides_floor && has_above_[static_cast<std::size_t>(lit.kind)];
        if (lit.above_water != above || (lit.by_lights && !lights.any_shines())) {
            continue;
        }
        lit.program.use();
        lit.environment.apply(frame, view);
        set_uniforms(lit, terrain);
        gl::Program::set(lit.has_reflection, reflection != nullptr ? 1.0F : 0.0F);
        gl::Program::set(lit.clip, plane);
        const PatchLights chosen{lights.lit(), lit.by_lights, light_sets_per_block(),
                                 [&lights](std::uint32_t block) { lights.bind_block(block); }};
        const PatchLights *const by_lights = lights.any_shines() ? &chosen : nullptr;
        choose(frame, view, plane, static_cast<PatchKinds>(1U << static_cast<unsigned>(lit.kind)), by_lights);
        frame.terrain()->draw(view, lit.uniforms, by_lights);
    }
    if (clipped_at_water) {
        glDisable(GL_CLIP_DISTANCE0);
    }
}

} // namespace paradize
