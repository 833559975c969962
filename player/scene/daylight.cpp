#include "scene/daylight.hpp"

#include "scene/turn.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace paradize {

namespace {

using assets::DaytimeKey;
using assets::SceneFile;
using assets::SkyLight;

// Sines of the elevations between which a light rises: half a degree below the horizon, two above.
constexpr float set_sine = -0.009F;
constexpr float risen_sine = 0.035F;
// Sines of the sun's elevations between which night falls: 2 degrees above the horizon, 10 below.
constexpr float dusk_sine = 0.035F;
constexpr float night_sine = -0.174F;

float luminance(const glm::vec3 &c) {
    return glm::dot(c, glm::vec3(0.2126F, 0.7152F, 0.0722F));
}

glm::vec3 direction_of(double azimuth, double elevation) {
    return glm::vec3(std::cos(elevation) * std::sin(azimuth), std::sin(elevation),
                     -std::cos(elevation) * std::cos(azimuth));
}

/// Returns the angle from a to b by the shorter way.
double shorter(double from, double to) {
    return std::remainder(to - from, turn);
}

/// The keys around a second, and how far it lies between the second and the third of them.
struct KeyBlend {
    std::array<std::size_t, 4> key{};
    std::array<double, 3> span_s{}; // between neighbours
    double share = 0.0;             // of the way from key[1] to key[2]
};

KeyBlend blend_of(const SceneFile &file, double flight_s) {
    const std::vector<DaytimeKey> &keys = file.daytime;
    const std::size_t count = keys.size();
    KeyBlend out;
    const std::size_t here = key_before(file, flight_s);
    for (std::size_t i = 0; i < 4; ++i) {
        out.key[i] = (here + count + i - 1) % count;
    }
    const auto after = [&](double from_s, double to_s) {
        const double span = to_s - from_s;
        return span > 0.0 ? span : span + file.flight.duration_s;
    };
    for (std::size_t i = 0; i < 3; ++i) {
        out.span_s[i] = after(keys[out.key[i]].at_s, keys[out.key[i + 1]].at_s);
    }
    double since_s = flight_s - keys[here].at_s;
    if (since_s < 0.0) {
        since_s += file.flight.duration_s;
    }
    out.share = std::clamp(since_s / out.span_s[1], 0.0, 1.0);
    return out;
}

/// Slope at a key between two others: F. N. Fritsch, J. Butland, "A Method for Constructing Local Monotone
/// Piecewise Cubic Interpolants", 1984. rise: to this key and from it.
double slope_at(double rise_before, double span_before, double rise_after, double span_after) {
    const double before = rise_before / span_before;
    const double after = rise_after / span_after;
    if (before * after <= 0.0) {
        return 0.0;
    }
    const double weight = 2.0 * span_after + span_before;
    const double other = span_after + 2.0 * span_before;
    return (weight + other) / (weight / before + other / after);
}

/// Returns how far a value has risen from key[1]. rises: from each key to the next.
double rise_at(const KeyBlend &blend, const std::array<double, 3> &rises) {
    const double first = slope_at(rises[0], blend.span_s[0], rises[1], blend.span_s[1]);
    const double last = slope_at(rises[1], blend.span_s[1], rises[2], blend.span_s[2]);
    const double u = blend.share;
    const double span = blend.span_s[1];
    return u * (1.0 - u) * (1.0 - u) * span * first + u * u * (3.0 - 2.0 * u) * rises[1] -
           u * u * (1.0 - u) * span * last;
}

template <typename Of>
double value_at(const SceneFile &file, const KeyBlend &blend, Of of) {
    std::array<double, 4> values{};
    for (std::size_t i = 0; i < 4; ++i) {
        values[i] = static_cast<double>(of(file.daytime[blend.key[i]]));
    }
    return values[1] + rise_at(blend, {values[1] - values[0], values[2] - values[1], values[3] - values[2]});
}

template <typename Of>
glm::vec3 color_at(const SceneFile &file, const KeyBlend &blend, Of of) {
    glm::vec3 out;
    for (int channel = 0; channel < 3; ++channel) {
        out[channel] = static_cast<float>(
            value_at(file, blend, [&](const DaytimeKey &key) { return glm::vec3(of(key))[channel]; }));
    }
    return out;
}

struct Angles {
    double azimuth = 0.0, elevation = 0.0;
};

Angles angles_at(const SceneFile &file, const KeyBlend &blend, SkyLight DaytimeKey::*light) {
    std::array<double, 4> azimuth{};
    for (std::size_t i = 0; i < 4; ++i) {
        azimuth[i] = static_cast<double>((file.daytime[blend.key[i]].*light).azimuth_rad);
    }
    const std::array<double, 3> turns{shorter(azimuth[0], azimuth[1]), shorter(azimuth[1], azimuth[2]),
                                      shorter(azimuth[2], azimuth[3])};
    return {azimuth[1] + rise_at(blend, turns),
            value_at(file, blend, [&](const DaytimeKey &key) { return (key.*light).elevation_rad; })};
}

glm::vec3 radiance_of(const SkyLight &light) {
    return light.color * light.intensity;
}

/// The light that a key's sky turns with.
SkyLight DaytimeKey::*light_of(const DaytimeKey &key) {
    return key.moon.intensity > key.sun.intensity ? &DaytimeKey::moon : &DaytimeKey::sun;
}

Daylight standing_light(const SceneFile &file) {
    Daylight out;
    out.to_light = file.sun.direction;
    out.radiance = file.sun.color * file.sun.intensity;
    out.angular_radius_rad = 0.5F * file.sun.angular_diameter_rad;
    out.ambient = file.ambient.color * file.ambient.intensity;
    out.fog = file.fog.color;
    out.fog_density_per_m = file.fog.density_per_m;
    out.exposure = file.exposure;
    return out;
}

/// A light that stands below the horizon gives none.
glm::vec3 risen(const Disc &disc) {
    return disc.radiance * glm::smoothstep(set_sine, risen_sine, disc.direction.y);
}

} // namespace

std::size_t key_before(const SceneFile &file, double flight_s) {
    const std::vector<DaytimeKey> &keys = file.daytime;
    const auto after = std::ranges::upper_bound(keys, flight_s, {}, &DaytimeKey::at_s) - keys.begin();
    return (static_cast<std::size_t>(after) + keys.size() - 1) % keys.size();
}

Daylight daylight_at(const SceneFile &file, double flight_s, double light_steps_per_s) {
    Daylight out = standing_light(file);
    if (file.daytime.empty()) {
        return out;
    }
    const KeyBlend blend = blend_of(file, flight_s);
    const std::array<SkyLight DaytimeKey::*, 2> lights{&DaytimeKey::sun, &DaytimeKey::moon};
    const std::array<Disc *, 2> discs{&out.sun, &out.moon};
    std::array<Angles, 2> angles;
    for (std::size_t i = 0; i < 2; ++i) {
        angles[i] = angles_at(file, blend, lights[i]);
        discs[i]->direction = direction_of(angles[i].azimuth, angles[i].elevation);
        discs[i]->radiance =
            color_at(file, blend, [&](const DaytimeKey &key) { return radiance_of(key.*lights[i]); });
    }
    // No key with light of the one is beside one with light of the other, so both are dark where they change.
    out.by_moon = luminance(out.moon.radiance) > luminance(out.sun.radiance);
    const double step_s = std::floor(flight_s * light_steps_per_s) / light_steps_per_s;
    const Angles stepped = angles_at(file, blend_of(file, step_s), lights[out.by_moon ? 1 : 0]);
    out.to_light = direction_of(stepped.azimuth, stepped.elevation);
    out.radiance = risen(out.brighter());
    out.angular_radius_rad = 0.5F * (out.by_moon ? file.moon_diameter_rad : file.sun.angular_diameter_rad);
    out.haze_glow = std::min(luminance(out.radiance), 1.0F);
    out.ambient = color_at(file, blend,
                           [](const DaytimeKey &key) { return key.ambient.color * key.ambient.intensity; });
    out.fog = color_at(file, blend, [](const DaytimeKey &key) { return key.fog.color; });
    out.fog_density_per_m = static_cast<float>(
        value_at(file, blend, [](const DaytimeKey &key) { return key.fog.density_per_m; }));
    out.exposure =
        static_cast<float>(value_at(file, blend, [](const DaytimeKey &key) { return key.exposure; }));
    out.night = glm::smoothstep(dusk_sine, night_sine, out.sun.direction.y);

    for (std::size_t i = 0; i < 2; ++i) {
        out.sky.key[i] = blend.key[i + 1];
        const DaytimeKey &key = file.daytime[out.sky.key[i]];
        const auto light = light_of(key);
        const double azimuth = angles[light == &DaytimeKey::moon ? 1 : 0].azimuth;
        out.sky.turn_rad[i] = static_cast<float>(shorter(static_cast<double>(key.sky_azimuth_rad), azimuth));
    }
    out.sky.share = glm::smoothstep(0.0F, 1.0F, static_cast<float>(blend.share));
    if (file.clouds) {
        const double repeats = file.clouds->drift_repeats * flight_s / file.flight.duration_s;
        out.clouds_turn_rad = static_cast<float>(turn * std::remainder(repeats, 1.0) / file.clouds->repeat);
    }
    return out;
}

} // namespace paradize
