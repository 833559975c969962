#include "assets/scene/fields.hpp"
#include "number_text.hpp"

#include <algorithm>
#include <cmath>

namespace paradize::assets {

namespace {

constexpr double max_turn_rad = 1e3;
constexpr double min_scale = 1e-6, max_scale = 1e6;
constexpr double min_fov_rad = 1e-3, max_fov_rad = 3.1;
constexpr double min_near_m = 1e-5, min_far_m = 1e-4;
constexpr int max_laps = 10000, max_beats = 100000;
constexpr double max_beat_rad = 1.6;          // a quarter of a turn
constexpr double max_pause = 0.9;             // of the time
constexpr int max_particles = 1000000;        // of all fields together
constexpr std::size_t max_instances = 200000; // of all objects together

AlphaMode alpha_mode(const JsonObject &from) {
    const std::string mode = from.text_or("alpha_mode", "opaque");
    if (mode == "opaque") {
        return AlphaMode::opaque;
    }
    if (mode == "mask") {
        return AlphaMode::mask;
    }
    if (mode != "blend") {
        from.fail("alpha_mode", "\"" + mode + "\" is not opaque, mask or blend");
    }
    return AlphaMode::blend;
}

std::array<Wrap, 2> wraps(const JsonObject &from) {
    std::array<Wrap, 2> found{};
    const std::vector<std::string> words = from.texts("wrap", 2);
    if (words.size() != 2) {
        from.fail("wrap", "must be two words");
    }
    for (std::size_t axis = 0; axis < 2; ++axis) {
        if (words[axis] == "clamp") {
            found[axis] = Wrap::clamp;
        } else if (words[axis] == "mirror") {
            found[axis] = Wrap::mirror;
        } else if (words[axis] != "repeat") {
            from.fail("wrap", "\"" + words[axis] + "\" is not repeat, clamp or mirror");
        }
    }
    return found;
}

Material material(const SceneFile &scene, const JsonObject &from, const std::string &name) {
    Material value;
    value.name = name;
    if (const auto maps = from.object_or_none("maps")) {
        for_each_map([&](ObjectMap map, std::string_view key) {
            if (!is_second(map)) {
                value.maps[map] = optional_artifact(scene, *maps, key, ArtifactKind::texture);
            }
        });
        maps->reject_unknown_keys();
    }
    if (const auto second = from.object_or_none("second")) {
        const JsonObject maps = second->object("maps");
        for_each_map([&](ObjectMap map, std::string_view key) {
            if (is_second(map)) {
                key.remove_prefix(second_prefix.size());
                value.maps[map] = optional_artifact(scene, maps, key, ArtifactKind::texture);
            }
        });
        maps.reject_unknown_keys();
        value.second_wrap = wraps(*second);
        second->reject_unknown_keys();
    }
    if (from.has("wrap")) {
        value.wrap = wraps(from);
    }
    value.nearest = from.boolean_or("nearest", value.nearest);
    value.color = triple(from, "color", 0.0, 1e4);
    value.opacity = real_or(from, "opacity", 0.0, 1.0, value.opacity);
    value.metalness = real_or(from, "metalness", 0.0, 1.0, value.metalness);
    if (from.has("emission")) {
        value.emission = triple(from, "emission", 0.0, max_radiance);
    }
    value.occlusion_strength = real_or(from, "occlusion_strength", 0.0, 1.0, value.occlusion_strength);
    value.parallax_scale = real_or(from, "parallax_scale", 0.0, 10.0, value.parallax_scale);
    value.parallax_bias = real_or(from, "parallax_bias", -10.0, 10.0, value.parallax_bias);
    if (from.has("parallax_limit")) {
        value.parallax_limit = real(from, "parallax_limit", 0.0, 100.0);
    }
    value.specular = real_or(from, "specular", 0.0, 1e3, value.specular);
    value.smoothness = real_or(from, "smoothness", 0.0, 1.0, value.smoothness);
    value.two_sided = from.boolean_or("two_sided", value.two_sided);
    value.translucency = real_or(from, "translucency", 0.0, 1.0, value.translucency);
    value.alpha_mode = alpha_mode(from);
    value.alpha_cutoff = real_or(from, "alpha_cutoff", 0.0, 1.0, value.alpha_cutoff);
    value.vertex_colors = from.boolean_or("vertex_colors", value.vertex_colors);
    value.unlit = from.boolean_or("unlit", value.unlit);
    value.vertex_lit = from.boolean_or("vertex_lit", value.vertex_lit);
    from.reject_unknown_keys();
    return value;
}

Placement placement(const JsonObject &from) {
    Placement value;
    value.position = position(from, "position");
    if (from.has("rotation")) {
        const std::vector<double> q = from.numbers("rotation", 4, -1.001, 1.001);
        const glm::dquat rotation(q[3], q[0], q[1], q[2]);
        const double squared = glm::dot(rotation, rotation);
        if (!(std::abs(squared - 1.0) <= 1e-3)) {
            from.fail("rotation", "has the squared length " + shortest(squared) + ", must be 1");
        }
        value.rotation = glm::normalize(rotation);
    }
    if (from.has("scale")) {
        const std::vector<double> s = from.numbers("scale", 3, -max_scale, max_scale);
        value.scale = {s[0], s[1], s[2]};
        for (const double along : s) {
            if (std::abs(along) < min_scale) {
                from.fail("scale", "is " + shortest(along) + " along an axis, its size must be at least " +
                                       shortest(min_scale));
            }
        }
    }
    from.reject_unknown_keys();
    return value;
}

Motion motion(const JsonObject &from) {
    Motion value;
    value.laps = static_cast<int>(from.integer("laps", -max_laps, max_laps));
    if (value.laps == 0) {
        from.fail("laps", "is 0, must be another whole number");
    }
    const std::vector<double> radii = from.numbers("radius_m", 2, 0.0, max_length_m);
    value.radius_m = {radii[0], radii[1]};
    value.rise_m = from.number("rise_m", 0.0, max_length_m);
    value.bank_rad = from.number("bank_rad", -max_beat_rad, max_beat_rad);
    value.ahead = from.boolean_or("ahead", value.ahead);
    value.pauses = static_cast<int>(from.integer("pauses", 0, max_laps));
    value.pause_share = from.number("pause_share", 0.0, max_pause);
    if (const auto beat = from.object_or_none("beat")) {
        value.beat.per_lap = static_cast<int>(beat->integer("per_lap", 1, max_beats));
        value.beat.hinge_m = real(*beat, "hinge_m", 0.0, 1e4);
        value.beat.lift_rad = beat->number("lift_rad", 0.0, max_beat_rad);
        value.beat.swing_rad = beat->number("swing_rad", 0.0, max_beat_rad);
        value.beat.lag_rad_per_m = real(*beat, "lag_rad_per_m", 0.0, 1e4);
        value.beat.stagger_rad_per_m = real(*beat, "stagger_rad_per_m", 0.0, 1e4);
        value.beat.glides = static_cast<int>(beat->integer("glides", 0, max_laps));
        value.beat.glide_share = beat->number("glide_share", 0.0, max_pause);
        beat->reject_unknown_keys();
    }
    from.reject_unknown_keys();
    return value;
}

glm::dvec4 cubic(const std::vector<double> &v) {
    return {v[0], v[1], v[2], v[3]};
}

} // namespace

void read_objects(const JsonObject &root, SceneFile &out) {
    if (!root.has("objects")) {
        return;
    }
    std::size_t left = max_instances;
    for (const JsonObject &from : root.objects("objects", max_entries)) {
        Object value;
        value.name = from.text("name");
        if (from.has("views")) {
            const std::vector<std::string> views = from.texts("views", 4);
            const auto drawn = [&](std::string_view view) {
                return std::ranges::find(views, view) != views.end();
            };
            value.camera = drawn("camera");
            value.shadow = drawn("shadow");
            value.reflection = drawn("reflection");
            value.refraction = drawn("refraction");
        }
        value.mesh = required_artifact(out, from, "mesh", ArtifactKind::mesh);
        value.center = position(from, "center");
        value.radius_m = real(from, "radius_m", 0.0, max_length_m);
        for (const JsonObject &lod : from.objects("lods", 64)) {
            value.lods.push_back({lod.text("node"), real(lod, "error_m", 0.0, max_length_m)});
            lod.reject_unknown_keys();
        }
        if (const auto materials = from.object_or_none("materials")) {
            for (const std::string &name : materials->names()) {
                value.materials.push_back(material(out, materials->object(name), name));
            }
        }
        if (const auto sway = from.object_or_none("sway")) {
            const glm::vec2 reach{real(*sway, "lean_m", 0.0, 1e4), real(*sway, "flutter_m", 0.0, 1e4)};
            sway->reject_unknown_keys();
            for (Material &one : value.materials) {
                one.wind_reach = reach;
            }
            value.reach_m = reach.x + 1.1F * reach.y; // flutter has a small part across
        }
        if (const auto moves = from.object_or_none("motion")) {
            value.motion = motion(*moves);
            const Beat &beat = value.motion->beat;
            for (Material &one : value.materials) {
                one.beats = beat.per_lap != 0;
                one.beat = {beat.hinge_m, beat.lag_rad_per_m, beat.stagger_rad_per_m};
            }
        }
        for (const JsonObject &at : from.objects("instances", max_instances)) {
            if (left-- == 0) {
                from.fail("instances", "make more than " + std::to_string(max_instances) +
                                           " instances in all objects together");
            }
            value.instances.push_back(placement(at));
        }
        value.light_sets = light_sets_of(out, from, value.instances.size());
        from.reject_unknown_keys();
        out.objects.push_back(std::move(value));
    }
}

void read_particles(const JsonObject &root, SceneFile &out) {
    if (root.has("particles")) {
        int left = max_particles;
        for (const JsonObject &from : root.objects("particles", 1000)) {
            ParticleField value;
            value.name = from.text("name");
            value.center = position(from, "center");
            value.radius_m = real(from, "radius_m", 0.0, max_length_m);
            value.count = static_cast<int>(from.integer("count", 1, max_particles));
            if ((left -= value.count) < 0) {
                from.fail("count", "makes more than " + std::to_string(max_particles) +
                                       " particles in all fields together");
            }
            value.size_m = pair(from, "size_m", 0.0, 1e4);
            value.life_per_s = pair(from, "life_per_s", 1e-6, 1e4);
            value.threshold = real(from, "threshold", 0.0, 1.0);
            value.color = triple(from, "color", 0.0, max_radiance);
            const std::string motion = from.text_or("motion", "drift");
            value.swarm = motion == "swarm";
            if (!value.swarm && motion != "drift") {
                from.fail("motion", "\"" + motion + "\" is not drift or swarm");
            }
            value.wander_m = real_or(from, "wander_m", 0.0, max_length_m, 0.0F);
            from.reject_unknown_keys();
            out.particles.push_back(std::move(value));
        }
    }
}

void read_flight(const JsonObject &root, SceneFile &out) {
    const JsonObject from = root.object("flight");
    Flight &value = out.flight;
    value.duration_s = from.number("duration_s", min_flight_s, max_flight_s);
    value.fov_rad = real(from, "fov_rad", min_fov_rad, max_fov_rad);
    value.near_m = real(from, "near_m", min_near_m, max_length_m);
    value.far_m = real(from, "far_m", min_far_m, 10.0 * max_length_m);
    if (value.near_m >= value.far_m) {
        from.fail("near_m",
                  "is " + shortest(value.near_m) + ", must be smaller than far_m, " + shortest(value.far_m));
    }
    for (const JsonObject &part : from.objects("segments", max_entries)) {
        FlightSegment segment;
        const auto eye = part.rows("eye", 3, 4, -max_position_m, max_position_m);
        const auto target = part.rows("target", 3, 4, -max_position_m, max_position_m);
        if (eye.size() != 3 || target.size() != 3) {
            part.fail("eye", "and target must have three rows: x, y, z");
        }
        for (std::size_t axis = 0; axis < 3; ++axis) {
            segment.eye[axis] = cubic(eye[axis]);
            segment.target[axis] = cubic(target[axis]);
        }
        segment.roll = cubic(part.numbers("roll", 4, -max_turn_rad, max_turn_rad));
        part.reject_unknown_keys();
        value.segments.push_back(segment);
    }
    if (value.segments.empty()) {
        from.fail("segments", "are missing");
    }
    const auto last = static_cast<double>(value.segments.size());
    for (const std::vector<double> &row : from.rows("time_table", 1000000, 3, -1e9, 1e9)) {
        value.time_table.push_back({row[0], row[1], row[2]});
    }
    const std::vector<TimeKnot> &table = value.time_table;
    for (std::size_t i = 1; i < table.size(); ++i) {
        if (!(table[i].time_s > table[i - 1].time_s) || table[i].position < table[i - 1].position) {
            from.fail("time_table[" + std::to_string(i) + "]",
                      "second " + shortest(table[i].time_s) + " at " + shortest(table[i].position) +
                          " must come after second " + shortest(table[i - 1].time_s) + " at " +
                          shortest(table[i - 1].position));
        }
    }
    if (table.size() < 2 || table.front().time_s != 0.0 || table.front().position < 0.0 ||
        std::abs(table.back().time_s - value.duration_s) > 1e-3 || table.back().position > last + 1e-6) {
        from.fail("time_table", "must start at second 0, end at duration_s and stay within the segments");
    }
    from.ignore({"waypoint_u", "errors"}); // quality of the path fit, not used here
    from.reject_unknown_keys();
}

} // namespace paradize::assets
