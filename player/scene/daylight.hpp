#pragma once
// The light at one second of the flight: sun, moon, ambient light, haze, exposure and sky. Uses no GL.

#include "assets/scene/file.hpp"
#include "scene/quality.hpp"

#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cstddef>

namespace paradize {

/// The sky between two keys of the scene.
struct SkyBlend {
    std::array<std::size_t, 2> key{}; // indices into SceneFile::daytime
    float share = 0.0F;               // of the second key's sky
    // How far each key's sky is turned about Y, from north over east, so that its light stands where it does
    // now.
    std::array<float, 2> turn_rad{};
};

struct Disc {
    glm::vec3 direction{0.0F, 1.0F, 0.0F}; // unit, from the ground
    glm::vec3 radiance{0.0F};              // colour x intensity, linear
};

struct Daylight {
    // The light that casts the shadows: the sun, or the moon where it is brighter.
    glm::vec3 to_light{0.0F, 1.0F, 0.0F}; // unit
    glm::vec3 radiance{0.0F};             // colour x intensity, linear
    float angular_radius_rad = 0.0F;
    float haze_glow = 1.0F;  // how much brighter haze is towards it: 1 in full light, 0 without any
    glm::vec3 ambient{0.0F}; // colour x intensity, linear
    glm::vec3 fog{0.0F};     // linear
    float fog_density_per_m = 0.0F;
    float exposure = 1.0F;
    float night = 0.0F; // 0 by day, 1 where the sun is deep below the horizon
    Disc sun, moon;     // in the sky, also below the horizon; of no use without SceneFile::daytime
    bool by_moon = false;
    SkyBlend sky;
    float clouds_turn_rad = 0.0F; // how far the clouds have drifted, from north over east

    const Disc &brighter() const { return by_moon ? moon : sun; }
    /// False where neither sun nor moon shines: nothing casts a shadow, and the air is not lit.
    bool shines() const { return std::max({radiance.r, radiance.g, radiance.b}) > 1e-4F; }
};

/// Returns the light at a second of the flight, in [0, duration). A scene without keys has the same light at
/// all times. The values of keys are joined by curves that do not overshoot, and that meet at the flight's
/// end. The light that casts the shadows turns in steps, because each has the shadow map drawn again.
Daylight daylight_at(const assets::SceneFile &file, double flight_s,
                     double light_steps_per_s = RenderSettings().shadow_steps_per_s);

/// Returns the index of the key at or before a second, and wraps around: before the first key, the last one.
std::size_t key_before(const assets::SceneFile &file, double flight_s);

} // namespace paradize
