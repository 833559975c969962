// The members of scene.json that say how the light changes along the flight.

#include "assets/scene/fields.hpp"

#include "number_text.hpp"

namespace paradize::assets {

namespace {

constexpr std::size_t most_keys = 1000;
constexpr double most_angle_rad = 6.5;
constexpr double quarter_turn_rad = 1.571;
constexpr long long most_repeats = 1000;

SkyLight sky_light(const JsonObject &from) {
    SkyLight out;
    out.azimuth_rad = real(from, "azimuth_rad", -most_angle_rad, most_angle_rad);
    out.elevation_rad = real(from, "elevation_rad", -quarter_turn_rad, quarter_turn_rad);
    out.color = triple(from, "color", 0.0, max_radiance);
    out.intensity = real(from, "intensity", 0.0, max_radiance);
    from.reject_unknown_keys();
    return out;
}

Clouds clouds(const JsonObject &from, const SceneFile &scene) {
    Clouds out;
    out.map = required_artifact(scene, from, "color", ArtifactKind::texture);
    out.high_rad = real(from, "high_rad", 1e-3, quarter_turn_rad);
    out.repeat = static_cast<int>(from.integer("repeat", 1, most_repeats));
    out.drift_repeats = static_cast<int>(from.integer("drift_repeats", -most_repeats, most_repeats));
    from.reject_unknown_keys();
    return out;
}

} // namespace

Ambient read_ambient(const JsonObject &from) {
    Ambient out;
    out.color = triple(from, "color", 0.0, max_radiance);
    out.intensity = real(from, "intensity", 0.0, max_radiance);
    from.reject_unknown_keys();
    return out;
}

Fog read_fog(const JsonObject &from) {
    Fog out;
    out.color = triple(from, "color", 0.0, max_radiance);
    out.density_per_m = real(from, "density_per_m", 0.0, 1e3);
    from.reject_unknown_keys();
    return out;
}

void read_daytime(const JsonObject &root, SceneFile &out) {
    const auto daytime = root.object_or_none("daytime");
    if (!daytime) {
        return;
    }
    out.moon_diameter_rad = real(*daytime, "moon_diameter_rad", 0.0, 3.2);
    for (const JsonObject &from : daytime->objects("keys", most_keys)) {
        DaytimeKey key;
        key.at_s = from.number("at_s", 0.0, out.flight.duration_s);
        if (key.at_s >= out.flight.duration_s ||
            (!out.daytime.empty() && key.at_s <= out.daytime.back().at_s)) {
            from.fail("at_s", "is " + shortest(key.at_s) +
                                  ", must be above that of the key before and below the flight's " +
                                  shortest(out.flight.duration_s) + " s");
        }
        key.sun = sky_light(from.object("sun"));
        key.moon = sky_light(from.object("moon"));
        key.ambient = read_ambient(from.object("ambient"));
        key.fog = read_fog(from.object("fog"));
        key.exposure = real(from, "exposure", 1e-6, 1e6);
        key.sky = required_artifact(out, from, "cubemap", ArtifactKind::cubemap);
        key.sky_azimuth_rad = real(from, "cubemap_azimuth_rad", -most_angle_rad, most_angle_rad);
        from.reject_unknown_keys();
        out.daytime.push_back(std::move(key));
    }
    if (out.daytime.size() < 2) {
        daytime->fail("keys", "has " + std::to_string(out.daytime.size()) + " entries, must have 2 or more");
    }
    if (const auto from = daytime->object_or_none("clouds")) {
        out.clouds = clouds(*from, out);
    }
    daytime->reject_unknown_keys();
}

} // namespace paradize::assets
