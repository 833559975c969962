#include "passes/environment_bindings.hpp"

#include "gl/texture.hpp"
#include "scene/flight.hpp"
#include "scene/repeating.hpp"

#include <epoxy/gl.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace paradize {

namespace {

/// Wave layer: scale relative to `tile`, bearing in radians, speed relative to `scroll`. No two layers share
/// a period shorter than the flight, so that their sum does not visibly repeat.
struct Layer {
    double scale, bearing, speed;
};
constexpr std::array<Layer, Waves::layers> layer_table{
    {{1.0, 0.0, 1.0}, {1.73, 0.61, -1.0}, {0.137, -0.42, 0.45}}};

const assets::Water no_water;

/// The speed nearest to `tiles_per_s` that moves a layer by whole tiles, at least one, in a flight. As
/// whole_cycles_per_s, but for both axes together: one may stand still.
glm::dvec2 whole_tiles_per_s(const glm::dvec2 &tiles_per_s, double duration_s) {
    const glm::dvec2 moved = tiles_per_s * duration_s;
    if (glm::length(moved) < least_cycles) {
        return tiles_per_s;
    }
    glm::dvec2 whole = glm::round(moved);
    if (whole == glm::dvec2(0.0)) {
        const int longer = std::abs(moved.x) < std::abs(moved.y) ? 1 : 0;
        whole[longer] = std::copysign(1.0, moved[longer]);
    }
    return whole / duration_s;
}

// A sharp sky has 512 texels along an edge; the environment starts at its fourth mip.
constexpr float environment_trimmed_mips = 3.0F;
// Slightly coarser than the mip with two texels per edge.
constexpr float coarser_than_all = 2.3F;
const float environment_blur = std::log2(static_cast<float>(environment_px)) + 1.0F - coarser_than_all;

} // namespace

Waves waves_at(const assets::SceneFile &file, double elapsed_s, const glm::dvec3 &anchor) {
    const assets::Water &water = file.water ? *file.water : no_water;
    Waves waves;
    for (std::size_t i = 0; i < layer_table.size(); ++i) {
        const Layer &layer = layer_table[i];
        const double c = std::cos(layer.bearing);
        const double s = std::sin(layer.bearing);
        const double tile =
            layer.scale * water.wave_repeat / std::max(static_cast<double>(water.size_m), 1e-3);
        waves.rows[i] = glm::vec4(c * tile, s * tile, -s * tile, c * tile);
        const glm::dvec2 scroll(c * water.scroll_per_s.x + s * water.scroll_per_s.y,
                                c * water.scroll_per_s.y - s * water.scroll_per_s.x);
        const glm::dvec2 moved =
            elapsed_s * whole_tiles_per_s(layer.scale * layer.speed * scroll, file.flight.duration_s);
        // A value just below 1 may round to 1.0F, which equals 0 because the map repeats.
        const double origin_u = tile * (c * anchor.x + s * anchor.z);
        const double origin_v = tile * (c * anchor.z - s * anchor.x);
        waves.offsets[i] = glm::vec2(glm::fract(moved.x + origin_u), glm::fract(moved.y + origin_v));
        waves.lengths_m[static_cast<int>(i)] = static_cast<float>(1.0 / std::max(tile, 1e-6));
    }
    return waves;
}

glm::vec4 swash_at(const assets::SceneFile &file, double elapsed_s) {
    const assets::Water &water = *file.water;
    const double duration_s = file.flight.duration_s;
    const double wave = flight_second(elapsed_s, duration_s) / duration_s * water.swash_waves;
    const double number = std::floor(wave);
    return {water.swash_height_m, number, wave - number, water.swash_waves};
}

float water_scatter(const assets::Water &water) {
    const glm::vec3 &a = water.absorption_per_m;
    return 1.2F * (a.x + a.y + a.z) / 3.0F;
}

glm::vec3 water_glow(const assets::SceneFile &file, const Daylight &daylight) {
    if (!file.water) {
        return glm::vec3(0.0F);
    }
    const glm::vec3 sun = daylight.radiance * std::max(daylight.to_light.y, 0.0F);
    const glm::vec3 light = sun / std::numbers::pi_v<float> + daylight.ambient * 0.5F;
    return light * glm::mix(file.water->shallow_color, file.water->deep_color, 0.5F);
}

EnvironmentBindings::EnvironmentBindings(const PassSetup &setup, const gl::Program &program)
    : no_shadow_(gl::make_depth_comparison_layers(1, 1)) {
    program.set_unit("u_sky", unit_sky);
    program.set_unit("u_shadow_map", unit_shadow);
    program.set_unit("u_shadow_depth", unit_shadow_depth);
    if (setup.settings.shadow_filter >= ShadowFilter::penumbra) {
        depth_sampler_ = gl::make_sampler(gl::Wrap::clamp, gl::Filter::nearest);
    }
    if (setup.settings.mip_bias != 0.0F) {
        wave_sampler_ = gl::make_sampler(gl::Wrap::repeat, gl::Filter::mipmapped, 1.0F, std::nullopt,
                                         setup.settings.mip_bias);
    }
    program.set_unit("u_wave_normal", unit_wave_normal);
    program.set_unit("u_wave_dudv", unit_wave_dudv);
    sky_blur_location_ = program.location("u_sky_blur");
    sky_trimmed_mips_location_ = program.location("u_sky_trimmed_mips");
    shadow_texel_location_ = program.location("u_shadow_texel");
    shadow_cascades_location_ = program.location("u_shadow_cascades");
    shadow_penumbra_location_ = program.location("u_shadow_penumbra_m");
    shadow_blur_m_location_ = program.location("u_shadow_blur_m");
    shadow_range_m_location_ = program.location("u_shadow_range_m");
    wave_rows_location_ = program.location("u_wave_rows");
    wave_offsets_location_ = program.location("u_wave_offsets");
    caustics_location_ = program.location("u_caustics");
    sun_refracted_location_ = program.location("u_sun_refracted");
    water_glow_location_ = program.location("u_water_glow");
    water_scatter_location_ = program.location("u_water_scatter");
    clip_plane_location_ = program.location("u_clip_plane");
    refraction_index_location_ = program.location("u_refraction_index");
    refracting_location_ = program.location("u_refracting");
    swash_location_ = program.location("u_swash");
    if (const StreamedTexture *sky = setup.scene.texture(setup.scene.file().sky)) {
        sky_blur_ = std::max(0.0F, static_cast<float>(sky->levels()) - coarser_than_all);
        const assets::SceneFile &file = setup.scene.file();
        sky_trimmed_mips_ = static_cast<float>(file.find_artifact(file.sky)->trimmed_levels);
    }
}

void EnvironmentBindings::apply(const Frame &frame, const View &view) const {
    const assets::SceneFile &file = frame.scene.file();
    float blur = sky_blur_;
    float trimmed_mips = sky_trimmed_mips_;
    if (frame.shared.environment != nullptr) {
        gl::bind_texture(unit_sky, GL_TEXTURE_CUBE_MAP, frame.shared.environment->name());
        blur = environment_blur;
        trimmed_mips = environment_trimmed_mips;
    } else if (!file.daytime.empty()) {
        blur = -1.0F;
    } else if (const StreamedTexture *sky = frame.scene.texture(file.sky)) {
        sky->bind(unit_sky);
    }
    gl::Program::set(sky_blur_location_, blur);
    gl::Program::set(sky_trimmed_mips_location_, trimmed_mips);

    const gl::Texture *shadow = frame.shared.shadow_map;
    const unsigned shadow_name = shadow != nullptr ? shadow->name() : no_shadow_.name();
    gl::bind_texture(unit_shadow, GL_TEXTURE_2D_ARRAY, shadow_name);
    if (depth_sampler_) {
        gl::bind_texture(unit_shadow_depth, GL_TEXTURE_2D_ARRAY, shadow_name, depth_sampler_.name());
    }
    // The penumbra grows with the sun's angle and the distance of the casters, about fourteen metres here.
    const float sun_radius_rad = std::max(frame.daylight.angular_radius_rad, 0.002F);
    gl::Program::set(shadow_texel_location_, 1.0F / static_cast<float>(frame.settings.shadow_size_px));
    gl::Program::set(shadow_penumbra_location_, sun_radius_rad * 14.0F);
    if (shadow_cascades_location_ >= 0) {
        glUniform4fv(shadow_cascades_location_, frame.settings.shadow_cascades,
                     glm::value_ptr(frame.shared.shadow_cascades[0]));
    }
    const View &light = frame.view(ViewKind::light);
    gl::Program::set(shadow_range_m_location_, light.far_m - light.near_m);
    gl::Program::set(shadow_blur_m_location_, file.shadow ? file.shadow->blur_distance_m : 0.0F);

    const bool refracting = view.kind == ViewKind::refraction;
    glm::vec4 clip_plane = view.clipped ? view.clip_plane : glm::vec4(0.0F, 0.0F, 0.0F, 1.0F);
    const assets::Water &water = file.water ? *file.water : no_water;
    if (const StreamedTexture *map = frame.scene.texture(water.normal)) {
        map->bind(unit_wave_normal, wave_sampler_.name());
    }
    if (const StreamedTexture *map = frame.scene.texture(water.dudv)) {
        map->bind(unit_wave_dudv, wave_sampler_.name());
    }
    const Waves waves = waves_at(file, frame.clock.elapsed_s, view.anchor);
    if (wave_rows_location_ >= 0) {
        glUniform4fv(wave_rows_location_, Waves::layers, glm::value_ptr(waves.rows[0]));
    }
    if (wave_offsets_location_ >= 0) {
        glUniform2fv(wave_offsets_location_, Waves::layers, glm::value_ptr(waves.offsets[0]));
    }
    if (swash_location_ >= 0) {
        gl::Program::set(swash_location_, swash_at(file, frame.clock.elapsed_s));
    }
    gl::Program::set(caustics_location_, file.water ? 1.0F : 0.0F);
    gl::Program::set(water_glow_location_, water_glow(file, frame.daylight));
    gl::Program::set(water_scatter_location_, water_scatter(water));
    glm::vec3 refracted_sun = frame.daylight.to_light;
    refracted_sun.x /= water_refraction;
    refracted_sun.z /= water_refraction;
    refracted_sun.y = std::sqrt(
        std::max(0.0F, 1.0F - refracted_sun.x * refracted_sun.x - refracted_sun.z * refracted_sun.z));
    gl::Program::set(sun_refracted_location_, refracted_sun);
    gl::Program::set(clip_plane_location_, clip_plane);
    gl::Program::set(refraction_index_location_, refracting ? water_refraction : 1.0F);
    gl::Program::set(refracting_location_, refracting ? 1.0F : 0.0F);
}

std::string shadow_define(const RenderSettings &settings) {
    return "SHADOW_FILTER " + std::to_string(static_cast<int>(settings.shadow_filter)) +
           "\n#define SKY_LIGHT " + (settings.sky_light ? "1" : "0");
}

std::string cascades_define(const RenderSettings &settings) {
    return "SHADOW_CASCADES " + std::to_string(settings.shadow_cascades);
}

std::string swash_define(const PassSetup &setup) {
    const assets::SceneFile &file = setup.scene.file();
    return file.water && file.water->swash_height_m > 0.0F ? "SWASH 1" : "SWASH 0";
}

void depth_bias(bool on) {
    if (on) {
        glEnable(GL_POLYGON_OFFSET_FILL);
        glPolygonOffset(1.5F, 2.0F);
    } else {
        glDisable(GL_POLYGON_OFFSET_FILL);
        glPolygonOffset(0.0F, 0.0F);
    }
}

} // namespace paradize
