#pragma once
// What every lit surface reads besides its own maps: the sky, the sun's shadow, the waves above it.

#include "gl/handle.hpp"
#include "gl/program.hpp"
#include "passes/frame.hpp"
#include "passes/pass.hpp"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <array>

namespace paradize {

/// Texture units: 0 to 7 are a pass's own, these are shared.
enum SharedUnit : int {
    unit_sky = 8,
    unit_shadow = 9,
    unit_wave_normal = 10,
    unit_wave_dudv = 11,
    unit_shadow_depth = 12
};

/// Index of refraction of water: how much nearer the floor looks from above, and how far rays bend.
inline constexpr float water_refraction = 1.33F;

/// The layers of waves at a moment (shaders/lib/waves.glsl).
struct Waves {
    static constexpr int layers = 3;
    std::array<glm::vec4, layers> rows{};    // xz in metres to UV: two rows
    std::array<glm::vec2, layers> offsets{}; // UV, in [0, 1)
    glm::vec3 lengths_m{1.0F};               // of one repeat of the map
};

/// Layers 0 and 1 run against each other, 2 is a slow swell. elapsed_s is reduced in double, so that the
/// waves move as evenly after a week as at the start; so is `anchor`, where xz is counted from in the world.
Waves waves_at(const assets::Water &water, double elapsed_s, const glm::dvec3 &anchor = glm::dvec3(0.0));

/// Sets and binds the shared inputs of one program that includes lib/light.glsl.
class EnvironmentBindings {
  public:
    EnvironmentBindings(const PassSetup &setup, const gl::Program &program);

    /// To the program in use; once per view.
    void apply(const Frame &frame, const View &view) const;

  private:
    gl::Texture no_shadow_;     // 1 x 1, so that the sampler has a depth texture to compare with
    gl::Sampler depth_sampler_; // reads the shadow map's depth without comparing; empty: nobody does
    gl::Sampler wave_sampler_;  // with the detail's mip bias; empty: the maps' own
    float sky_blur_ = -1.0F;
    int sky_blur_at_ = -1, shadow_texel_at_ = -1, shadow_texel_m_at_ = -1;
    int shadow_radius_at_ = -1, shadow_blur_m_at_ = -1, shadow_range_m_at_ = -1;
    int wave_rows_at_ = -1, wave_offsets_at_ = -1, caustics_at_ = -1;
    int sun_refracted_at_ = -1, water_glow_at_ = -1, water_scatter_at_ = -1;
    int clip_plane_at_ = -1, refraction_index_at_ = -1, refracting_at_ = -1;
    int sky_trimmed_mips_at_ = -1;
    float sky_trimmed_mips_ = 0.0F; // finer mips that the sky could have
};

/// Light from all sides inside the water, linear: what an eye below the surface sees far away.
glm::vec3 water_glow(const assets::SceneFile &file);
/// Share of light that water scatters per metre.
float water_scatter(const assets::Water &water);

/// What makes a program that includes lib/shadow.glsl look the shadow up as the detail says.
std::string shadow_define(const RenderSettings &settings);

/// Polygon offset for depth-only views, against a surface shadowing itself; off puts the default back.
void depth_bias(bool on);

} // namespace paradize
