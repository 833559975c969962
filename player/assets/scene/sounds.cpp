// Reads the sounds and the music of scene.json.

#include "assets/scene/fields.hpp"

namespace paradize::assets {

namespace {

constexpr std::size_t max_sounds = 64;
constexpr std::size_t max_points = 256; // of a line
constexpr std::size_t max_pieces = 16;  // of the music

Sound sound(const SceneFile &scene, const JsonObject &from) {
    Sound value;
    value.artifact = required_artifact(scene, from, "artifact", ArtifactKind::sound);
    value.volume = real(from, "volume", 0.0, 1.0);
    const std::vector<double> places =
        from.flat_rows("places", max_points, 3, -max_position_m, max_position_m);
    for (std::size_t i = 0; i < places.size(); i += 3) {
        value.places.emplace_back(places[i], places[i + 1], places[i + 2]);
    }
    value.radius_m = real(from, "radius_m", 1e-3, max_length_m);
    value.falloff = real(from, "falloff", 0.0, 4.0);
    if (const auto hours = from.object_or_none("hours")) {
        value.hours =
            SoundHours{hours->number("on_s", 0.0, max_flight_s), hours->number("off_s", 0.0, max_flight_s),
                       hours->number("fade_s", min_flight_s, max_flight_s)};
        hours->reject_unknown_keys();
    }
    from.ignore({"name"}); // for people
    from.reject_unknown_keys();
    return value;
}

} // namespace

void read_sounds(const JsonObject &root, SceneFile &out) {
    if (root.has("sounds")) {
        for (const JsonObject &from : root.objects("sounds", max_sounds)) {
            out.sounds.push_back(sound(out, from));
        }
    }
    if (const auto from = root.object_or_none("music")) {
        Music value;
        value.artifacts = from->texts("artifacts", max_pieces);
        for (const std::string &name : value.artifacts) {
            const Artifact *found = out.find_artifact(name);
            if (found == nullptr || found->kind != ArtifactKind::sound) {
                from->fail("artifacts", "names \"" + name + "\", which is not a sound");
            }
        }
        value.volume = real(*from, "volume", 0.0, 1.0);
        value.playing =
            static_cast<int>(from->integer("playing", 0, static_cast<long long>(value.artifacts.size())));
        from->reject_unknown_keys();
        out.music = std::move(value);
    }
}

} // namespace paradize::assets
