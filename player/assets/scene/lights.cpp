#include "assets/scene/fields.hpp"
#include "number_text.hpp"

#include <algorithm>

namespace paradize::assets {

namespace {

constexpr std::size_t max_lights = 256;
constexpr std::size_t max_sets = 4096;
constexpr double day_s = 86400.0;

PointLight light(const JsonObject &from) {
    PointLight value;
    value.name = from.text("name");
    value.position = position(from, "position");
    value.color = triple(from, "color", 0.0, max_radiance);
    value.intensity = real(from, "intensity", 0.0, max_radiance);
    value.radius_m = real(from, "radius_m", 1e-4, max_length_m);
    value.range_m = real(from, "range_m", 1e-3, max_length_m);
    if (const auto hours = from.object_or_none("hours")) {
        value.always = false;
        value.on_s = hours->number("on_s", 0.0, day_s);
        value.off_s = hours->number("off_s", 0.0, day_s);
        hours->reject_unknown_keys();
    }
    value.fade_s = real(from, "fade_s", 0.0, day_s);
    value.flicker = real(from, "flicker", 0.0, 1.0);
    value.beam_m = real_or(from, "beam_m", 0.0, max_length_m, 0.0F);
    from.reject_unknown_keys();
    return value;
}

LightSet set_of(const JsonObject &from, std::size_t lights) {
    const long long last = static_cast<long long>(lights) - 1;
    LightSet value;
    for (const long long index : from.integers("lights", max_lights_of_a_set, 0, last)) {
        value.lights.push_back(static_cast<std::uint32_t>(index));
    }
    if (std::ranges::adjacent_find(value.lights, std::ranges::greater_equal()) != value.lights.end()) {
        from.fail("lights", "must rise");
    }
    if (from.has("glow")) {
        value.glow = static_cast<std::uint32_t>(from.integer("glow", 0, last));
    }
    from.reject_unknown_keys();
    return value;
}

} // namespace

void read_lights(const JsonObject &root, SceneFile &out) {
    if (root.has("lights")) {
        for (const JsonObject &from : root.objects("lights", max_lights)) {
            out.lights.push_back(light(from));
        }
    }
    if (root.has("light_sets")) {
        out.light_sets.clear();
        for (const JsonObject &from : root.objects("light_sets", max_sets)) {
            out.light_sets.push_back(set_of(from, out.lights.size()));
        }
        if (out.light_sets.empty() || !out.light_sets[0].lights.empty() || out.light_sets[0].glow) {
            root.fail("light_sets", "must begin with an empty set");
        }
    }
}

std::vector<std::uint32_t> light_sets_of(const SceneFile &scene, const JsonObject &from, std::size_t count) {
    std::vector<std::uint32_t> out;
    if (!from.has("light_sets")) {
        return out;
    }
    const auto last = static_cast<long long>(scene.light_sets.size()) - 1;
    for (const long long index : from.integers("light_sets", count, 0, last)) {
        out.push_back(static_cast<std::uint32_t>(index));
    }
    if (out.size() != count) {
        from.fail("light_sets",
                  "has " + std::to_string(out.size()) + " entries, must have " + std::to_string(count));
    }
    return out;
}

} // namespace paradize::assets
