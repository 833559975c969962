#pragma once
// Binds the inputs that lit surfaces share: sky, shadow map and waves.

#include "gl/handle.hpp"
#include "gl/program.hpp"
#include "passes/frame.hpp"
#include "passes/pass.hpp"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <array>
#include <string>

namespace paradize {

/// Shared texture units. Units 0 to 7 belong to each pass.
enum SharedUnit : int {
    unit_sky = 8,
    unit_shadow = 9,
    unit_wave_normal = 10,
    unit_wave_dudv = 11,
    unit_shadow_depth = 12,
    first_free_unit = 13 // of 16 that every device has
};

/// Edge of the environment's faces (passes/environment_pass.hpp).
inline constexpr int environment_px = 64;

/// Index of refraction of water.
inline constexpr float water_refraction = 1.33F;

/// The wave layers at one time (shaders/lib/waves.glsl).
struct Waves {
    static constexpr int layers = 3;
    std::array<glm::vec4, layers> rows{};    // 2 x 2 matrix from world xz in metres to UV, two rows
    std::array<glm::vec2, layers> offsets{}; // UV, in [0, 1)
    glm::vec3 lengths_m{1.0F};               // of one repeat of the map
};

/// Returns the wave layers at `elapsed_s`. Layers 0 and 1 run against each other, layer 2 is a slow swell.
/// They repeat with the flight, save one that moves less than half a tile in it. Time and `anchor` (the
/// floating origin) are wrapped in double, so that the waves stay smooth after a week of playback.
Waves waves_at(const assets::SceneFile &file, double elapsed_s, const glm::dvec3 &anchor = glm::dvec3(0.0));

/// Returns u_swash of shaders/lib/swash.glsl: the waves that run up the beach. They repeat with the flight.
glm::vec4 swash_at(const assets::SceneFile &file, double elapsed_s);

/// Sets the shared uniforms and textures of one program that includes lib/light.glsl.
class EnvironmentBindings {
  public:
    EnvironmentBindings(const PassSetup &setup, const gl::Program &program);

    /// Call once per view, with the program in use.
    void apply(const Frame &frame, const View &view) const;

  private:
    gl::Texture no_shadow_;     // 1 x 1, because a shadow sampler always needs a depth texture
    gl::Sampler depth_sampler_; // reads raw depth from the shadow map; empty if the filter does not need it
    gl::Sampler wave_sampler_;  // adds the mip bias of the settings; empty: the maps' own samplers
    float sky_blur_ = -1.0F;
    int sky_blur_location_ = -1, shadow_texel_location_ = -1, shadow_cascades_location_ = -1;
    int shadow_penumbra_location_ = -1, shadow_blur_m_location_ = -1, shadow_range_m_location_ = -1;
    int wave_rows_location_ = -1, wave_offsets_location_ = -1, caustics_location_ = -1;
    int sun_refracted_location_ = -1, water_glow_location_ = -1, water_scatter_location_ = -1;
    int clip_plane_location_ = -1, refraction_index_location_ = -1, refracting_location_ = -1;
    int sky_trimmed_mips_location_ = -1, swash_location_ = -1;
    float sky_trimmed_mips_ = 0.0F; // finer mips that the bake left out
};

/// Returns the linear radiance of endless water around an eye below the surface.
glm::vec3 water_glow(const assets::SceneFile &file, const Daylight &daylight);
/// Returns the share of light that water scatters per metre.
float water_scatter(const assets::Water &water);

/// Return the defines SHADOW_FILTER with SKY_LIGHT, and SHADOW_CASCADES, for programs that include
/// lib/light.glsl.
std::string shadow_define(const RenderSettings &settings);
std::string cascades_define(const RenderSettings &settings);
/// Returns the define SWASH for programs that include lib/swash.glsl.
std::string swash_define(const PassSetup &setup);

/// Switches the polygon offset against self-shadowing on or off.
void depth_bias(bool on);

} // namespace paradize
