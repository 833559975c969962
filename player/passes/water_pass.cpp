#include "passes/water_pass.hpp"

#include "gl/texture.hpp"

#include <epoxy/gl.h>
#include <glm/gtc/type_ptr.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace paradize {

namespace {

/// The sea's grid extends so far from the eye: its corners reach the far plane.
float reach_of(const PassSetup &setup) {
    return 0.69F * setup.scene.file().flight.far_m;
}

std::string near_waves_define(const PassSetup &setup) {
    return setup.settings.near_waves ? "NEAR_WAVES 1" : "NEAR_WAVES 0";
}

std::string ripples_define(const PassSetup &setup) {
    return setup.scene.file().water->ripples.empty() ? "RIPPLES 0" : "RIPPLES 1";
}

/// Middle and half sides of the rectangle that the lights of a set that are on reach, from the views' anchor.
glm::vec4 lamplit(const assets::SceneFile &file, const assets::LightSet &set,
                  std::span<const float> strengths, const glm::dvec3 &anchor) {
    glm::dvec2 low(std::numeric_limits<double>::infinity());
    glm::dvec2 high = -low;
    for (const std::uint32_t index : set.lights) {
        const assets::PointLight &light = file.lights[index];
        if (strengths[index] > 0.0F) {
            const glm::dvec2 at(light.position.x - anchor.x, light.position.z - anchor.z);
            low = glm::min(low, at - static_cast<double>(light.range_m));
            high = glm::max(high, at + static_cast<double>(light.range_m));
        }
    }
    return low.x < high.x ? glm::vec4(0.5 * (low + high), 0.5 * (high - low)) : glm::vec4(0.0F);
}

/// A map of WaveShares. Half floats hold them to 0.0005.
gl::Texture share_map(const WaveShares &shares) {
    std::vector<float> pixels;
    for (const float share : shares.shares) {
        pixels.insert(pixels.end(), {share, 0.0F, 0.0F, 1.0F});
    }
    gl::Texture map = gl::make_target(GL_RGBA16F, shares.columns, shares.rows);
    gl::write_target(map, shares.columns, shares.rows, pixels);
    return map;
}

} // namespace

WaterPass::Lit::Lit(const PassSetup &setup, bool point_lights, bool in_water)
    : program(setup.shaders, "water.vert", "water.frag",
              {shadow_define(setup.settings), cascades_define(setup.settings),
               point_lights_define(point_lights), swash_define(setup), near_waves_define(setup),
               ripples_define(setup), in_water ? "IN_WATER 1" : "IN_WATER 0"}),
      environment(setup, program), half_size(program.location("u_half_size_m")),
      has_textures(program.location("u_has_textures")), distortion(program.location("u_distortion")),
      deep(program.location("u_deep_color")), shallow(program.location("u_shallow_color")),
      shine(program.location("u_specular_smoothness")), wave_length(program.location("u_wave_length_m")),
      fade_distance(program.location("u_fade_distance_m")), center(program.location("u_center")),
      near_waves(program.location("u_near_waves")), share_of_xz(program.location("u_share_of_xz")),
      light_set(program.location("u_light_set")), lamplit(program.location("u_lamplit")),
      rings(program.location("u_rings")), ripple_state(program.location("u_ripple_state")) {
    program.set_unit("u_reflection", unit_reflection);
    program.set_unit("u_refraction", unit_refraction);
    program.set_unit("u_wave_shares", unit_wave_shares);
}

WaterPass::WaterPass(const PassSetup &setup)
    : lit_(setup, false, false), from_below_(setup, false, true),
      clamped_(gl::make_sampler(gl::Wrap::clamp, gl::Filter::linear)),
      grid_(setup.settings.near_waves
                ? SeaGrid::with_waves(setup.scene.file().water->wave_length_m, reach_of(setup))
                : SeaGrid::flat(reach_of(setup))) {
    if (setup.scene.file().water->light_set != 0) {
        by_lights_.emplace(setup, true, false);
    }
    if (setup.settings.near_waves) {
        shares_ = wave_shares(setup.scene.file());
        share_map_ = share_map(shares_);
    }
}

void WaterPass::apply_waves(const Frame &frame, const View &view, const Lit &lit) const {
    const NearWaves waves = near_waves_at(frame.scene.file(), frame.clock.elapsed_s, view);
    glUniform4fv(lit.near_waves, near_wave_count, glm::value_ptr(waves[0]));
    const glm::dvec2 anchor(view.anchor.x, view.anchor.z);
    gl::Program::set(lit.share_of_xz,
                     glm::vec4(shares_.per_m, glm::dvec2(shares_.per_m) * (anchor - shares_.corner_m)));
    gl::bind_texture(unit_wave_shares, GL_TEXTURE_2D, share_map_.name());
}

void WaterPass::draw(const Frame &frame, const View &view) {
    if (view.kind != ViewKind::main) {
        return;
    }
    const assets::SceneFile &file = frame.scene.file();
    const assets::Water &water = *file.water;
    const bool in_water = view.eye.y < frame.water_m();
    const bool is_lit = !in_water && by_lights_ && frame.point_lights.lit()[water.light_set] != 0;
    const Lit &lit = in_water ? from_below_ : is_lit ? *by_lights_ : lit_;
    lit.program.use();
    lit.environment.apply(frame, view);
    if (is_lit) {
        gl::Program::set(lit.light_set, frame.point_lights.bind(water.light_set));
        gl::Program::set(lit.lamplit, lamplit(file, file.light_sets[water.light_set],
                                              frame.point_lights.strengths(), view.anchor));
    }
    const gl::Texture *reflection = frame.shared.reflection;
    const gl::Texture *refraction = frame.shared.refraction;
    gl::bind_texture(unit_reflection, GL_TEXTURE_2D, reflection != nullptr ? reflection->name() : 0,
                     clamped_.name());
    gl::bind_texture(unit_refraction, GL_TEXTURE_2D, refraction != nullptr ? refraction->name() : 0,
                     clamped_.name());
    gl::Program::set(lit.has_textures,
                     glm::vec2(reflection != nullptr ? 1.0F : 0.0F, refraction != nullptr ? 1.0F : 0.0F));
    const float half_m = 0.5F * water.size_m;
    gl::Program::set(lit.half_size, half_m);
    // The edge of the sea fades into haze before the far plane or the sea's own border.
    const float far_m = 0.69F * view.far_m;
    gl::Program::set(lit.fade_distance, far_m);
    gl::Program::set(lit.distortion, glm::vec2(water.reflection_distortion, water.refraction_distortion));
    gl::Program::set(lit.deep, water.deep_color);
    gl::Program::set(lit.shallow, water.shallow_color);
    gl::Program::set(lit.shine, glm::vec2(water.specular, water.smoothness));
    gl::Program::set(lit.wave_length, waves_at(frame.scene.file(), 0.0).lengths_m);
    const glm::vec2 center =
        frame.settings.near_waves ? grid_center(water, view) : glm::vec2(view.eye.x, view.eye.z);
    gl::Program::set(lit.center, center);
    if (frame.settings.near_waves) {
        apply_waves(frame, view, lit);
    }
    if (lit.rings >= 0) {
        const Ripples ripples = ripples_at(file, frame.clock.elapsed_s, view);
        glUniform4fv(lit.rings, most_rings, glm::value_ptr(ripples.rings[0]));
        gl::Program::set(lit.ripple_state, glm::vec2(static_cast<float>(ripples.count), ripples.phase));
    }

    glEnable(GL_BLEND);
    glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
    glDisable(GL_CULL_FACE);
    grid_.draw(view, center, half_m, frame.water_m(), 0.5F * water.wave_height_m);
    glEnable(GL_CULL_FACE);
    glBlendFunc(GL_ONE, GL_ZERO);
    glDisable(GL_BLEND);
}

} // namespace paradize
