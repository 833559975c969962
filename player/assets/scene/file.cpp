#include "assets/scene/file.hpp"

#include "assets/file_bytes.hpp"
#include "assets/scene/fields.hpp"
#include "error.hpp"
#include "number_text.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace paradize::assets {

namespace {

constexpr long long scene_version = 10;

class SceneReader {
  public:
    SceneReader(const JsonObject &root, SceneFile &out) : root_(root), out_(out) {}

    void read() {
        if (root_.text("format") != "paradize-scene") {
            root_.fail("format", "is \"" + root_.text("format") + "\", must be \"paradize-scene\"");
        }
        if (const long long version = root_.integer("version", 0, 1LL << 40); version != scene_version) {
            root_.fail("version", "is " + std::to_string(version) + ", this player reads version " +
                                      std::to_string(scene_version) +
                                      "; bake the scene again with the Paradize that came with the player");
        }
        head();
        artifacts();
        light();
        read_lights(root_, out_);
        read_terrain(root_, out_);
        water();
        read_objects(root_, out_);
        read_particles(root_, out_);
        read_sounds(root_, out_);
        read_flight(root_, out_);
        read_daytime(root_, out_);
        mark_drawn();
        root_.ignore({"budget", "check"}); // for `paradize check`
        root_.reject_unknown_keys();
    }

  private:
    /// Finds the artifacts that something refers to.
    void mark_drawn() {
        std::vector<std::string_view> names{out_.sky};
        for (const DaytimeKey &key : out_.daytime) {
            names.emplace_back(key.sky);
        }
        if (out_.clouds) {
            names.emplace_back(out_.clouds->map);
        }
        if (out_.terrain) {
            const Terrain &terrain = *out_.terrain;
            names.insert(names.end(), terrain.tiles.begin(), terrain.tiles.end());
            names.insert(names.end(), {terrain.sand_color, terrain.effect_color, terrain.effect_normal,
                                       terrain.sand_normal});
        }
        if (out_.water) {
            names.insert(names.end(), {out_.water->normal, out_.water->dudv});
        }
        for (const Object &object : out_.objects) {
            names.emplace_back(object.mesh);
            for (const Material &material : object.materials) {
                for_each_map(
                    [&](ObjectMap map, std::string_view) { names.emplace_back(material.maps[map]); });
            }
        }
        std::ranges::sort(names);
        for (Artifact &artifact : out_.artifacts) {
            artifact.drawn = std::ranges::binary_search(names, std::string_view(artifact.name));
        }
    }

    void head() {
        if (root_.has("vram_mb")) {
            out_.vram_mb = root_.number("vram_mb", 1.0, 1e9);
        }
        out_.name = root_.text("name");
        out_.exposure = real_or(root_, "exposure", 1e-6, 1e6, 1.0F);
        picture_size("viewport", out_.width_px, out_.height_px);
        out_.largest_width_px = out_.width_px;
        out_.largest_height_px = out_.height_px;
        picture_size("largest_viewport", out_.largest_width_px, out_.largest_height_px);
        if (const auto region = root_.object_or_none("free_camera")) {
            out_.free_camera = FreeCameraBox{position(*region, "low"), position(*region, "high"),
                                             real(*region, "near_m", 0.0, max_length_m)};
            region->reject_unknown_keys();
        }
        out_.lod_error_px = real_or(root_, "lod_error_px", 0.01, 100.0, 1.0F);
        out_.poster_s = root_.number_or("poster_s", 0.0, 86400.0, 0.0);
    }

    void picture_size(std::string_view key, int &width_px, int &height_px) {
        if (root_.has(key)) {
            root_.numbers(key, 2, 16, 16384); // two of them
            const std::vector<long long> size = root_.integers(key, 2, 16, 16384);
            width_px = static_cast<int>(size[0]);
            height_px = static_cast<int>(size[1]);
        }
    }

    void artifacts() {
        const JsonObject all = root_.object("artifacts");
        for (const std::string &name : all.names()) {
            const JsonObject entry = all.object(name);
            Artifact artifact;
            artifact.name = name;
            artifact.file = entry.text("file");
            const std::filesystem::path path(artifact.file);
            const bool escapes = std::find(path.begin(), path.end(), "..") != path.end();
            if (artifact.file.empty() || path.is_absolute() || escapes ||
                artifact.file.find('\0') != std::string::npos) {
                entry.fail("file", "\"" + artifact.file + "\" must be a path inside the scene's folder");
            }
            const std::string kind = entry.text("kind");
            if (kind == "mesh") {
                artifact.kind = ArtifactKind::mesh;
            } else if (kind == "texture") {
                artifact.kind = ArtifactKind::texture;
            } else if (kind == "cubemap") {
                artifact.kind = ArtifactKind::cubemap;
            } else if (kind == "sound") {
                artifact.kind = ArtifactKind::sound;
            } else {
                entry.fail("kind", "\"" + kind + "\" is not mesh, texture, cubemap or sound");
            }
            artifact.sha256 = entry.text("sha256");
            if (artifact.sha256.size() != 64 ||
                artifact.sha256.find_first_not_of("0123456789abcdef") != std::string::npos) {
                entry.fail("sha256", "\"" + artifact.sha256 + "\" must be 64 hex digits in lower case");
            }
            artifact.bytes =
                static_cast<std::uint64_t>(entry.integer("bytes", 1, static_cast<long long>(max_file_bytes)));
            artifact.first_needed_s = entry.number_or("first_needed_s", 0.0, 86400.0, 0.0);
            if (entry.has("max_level")) {
                artifact.max_level = static_cast<int>(entry.integer("max_level", 0, 31));
            }
            if (const auto detail = entry.object_or_none("required_detail")) {
                artifact.trimmed_levels = static_cast<int>(detail->integer("left_out", 0, 31));
                // for `paradize explain`
                detail->ignore({"coarser_left_out", "saved_bytes", "texels", "second_s", "view", "levels_s"});
                detail->reject_unknown_keys();
            }
            entry.ignore({"tier", "errors", "levels", "gutter", "also"}); // for `paradize check`
            entry.reject_unknown_keys();
            out_.artifacts.push_back(std::move(artifact));
        }
        if (!root_.has("streaming")) {
            return;
        }
        for (const std::string &name : root_.texts("streaming", max_entries)) {
            const Artifact *found = out_.find_artifact(name);
            if (found == nullptr) {
                root_.fail("streaming", "names \"" + name + "\", which is not an artifact");
            }
            out_.streaming.push_back(static_cast<std::uint32_t>(found - out_.artifacts.data()));
        }
    }

    void light() {
        const JsonObject sun = root_.object("sun");
        out_.sun.direction = triple(sun, "direction", -1.001, 1.001);
        const glm::vec3 d = out_.sun.direction;
        if (!(std::abs(glm::dot(d, d) - 1.0F) <= 1e-3F)) {
            sun.fail("direction", "has the squared length " + shortest(glm::dot(d, d)) + ", must be 1");
        }
        out_.sun.color = triple(sun, "color", 0.0, max_radiance);
        out_.sun.intensity = real(sun, "intensity", 0.0, max_radiance);
        out_.sun.angular_diameter_rad = real_or(sun, "angular_diameter_rad", 0.0, 3.2, 0.0093F);
        sun.reject_unknown_keys();
        if (const auto ambient = root_.object_or_none("ambient")) {
            out_.ambient = read_ambient(*ambient);
        }
        if (const auto fog = root_.object_or_none("fog")) {
            out_.fog = read_fog(*fog);
        }
        if (const auto wind = root_.object_or_none("wind")) {
            Wind value;
            value.direction = pair(*wind, "direction", -1.001, 1.001);
            const float squared = glm::dot(value.direction, value.direction);
            if (!(std::abs(squared - 1.0F) <= 1e-3F)) {
                wind->fail("direction", "has the squared length " + shortest(squared) + ", must be 1");
            }
            value.speed_m_per_s = real(*wind, "speed_m_per_s", 0.0, 1e3);
            value.gust_m = real(*wind, "gust_m", 1e-3, max_length_m);
            wind->reject_unknown_keys();
            out_.wind = value;
        }
        if (const auto sky = root_.object_or_none("sky")) {
            out_.sky = required_artifact(out_, *sky, "cubemap", ArtifactKind::cubemap);
            sky->reject_unknown_keys();
        }
        if (const auto shadow = root_.object_or_none("shadow")) {
            Shadow value;
            value.size_px = static_cast<int>(shadow->integer("size", 1, 16384));
            value.extent_m = real(*shadow, "extent_m", 1e-3, max_length_m);
            value.center = position(*shadow, "center");
            value.blur_distance_m = real_or(*shadow, "blur_distance_m", 0.0, max_length_m, 50.0F);
            shadow->reject_unknown_keys();
            out_.shadow = value;
        }
        if (root_.has("light_shafts")) {
            const JsonObject shafts = root_.object("light_shafts");
            LightShafts value;
            value.density_per_m = real(shafts, "density_per_m", 0.0, 1.0);
            value.anisotropy = real(shafts, "anisotropy", -0.9, 0.9);
            value.range_m = real(shafts, "range_m", 0.1, max_length_m);
            shafts.reject_unknown_keys();
            if (!out_.shadow) {
                root_.fail("light_shafts", "stands without shadow, which it shows in the air");
            }
            out_.light_shafts = value;
        }
        if (const auto mirror = root_.object_or_none("reflection")) {
            out_.reflection_scale = real(*mirror, "scale", 1e-2, 4.0);
            mirror->reject_unknown_keys();
        }
        if (const auto refraction = root_.object_or_none("refraction")) {
            out_.refraction_scale = real(*refraction, "scale", 1e-2, 4.0);
            refraction->reject_unknown_keys();
        }
    }

    void water() {
        const auto from = root_.object_or_none("water");
        if (!from) {
            return;
        }
        Water value;
        value.normal = required_artifact(out_, *from, "normal", ArtifactKind::texture);
        value.dudv = required_artifact(out_, *from, "dudv", ArtifactKind::texture);
        value.level_m = real(*from, "level_m", -max_length_m, max_length_m);
        value.size_m = real(*from, "size_m", 1e-3, max_length_m);
        value.wave_repeat = real(*from, "wave_repeat", 1e-4, 1e6);
        value.scroll_per_s = pair(*from, "scroll_per_s", -1e3, 1e3);
        value.reflection_distortion = real(*from, "reflection_distortion", 0.0, 1e3);
        value.refraction_distortion = real(*from, "refraction_distortion", 0.0, 1e3);
        value.deep_color = triple(*from, "deep_color", 0.0, max_radiance);
        value.shallow_color = triple(*from, "shallow_color", 0.0, max_radiance);
        value.absorption_per_m = triple(*from, "absorption_per_m", 0.0, 1e5);
        value.specular = real(*from, "specular", 0.0, 1e3);
        value.smoothness = real(*from, "smoothness", 0.0, 1.0);
        value.swash_height_m = real(*from, "swash_height_m", 0.0, 1e3);
        value.swash_waves = static_cast<int>(from->integer("swash_waves", 1, 4096));
        value.wave_length_m = real(*from, "wave_length_m", 0.1, 1e4);
        value.wave_height_m = real(*from, "wave_height_m", 0.0, 0.15 * value.wave_length_m);
        if (from->has("light_set")) {
            const auto last = static_cast<long long>(out_.light_sets.size()) - 1;
            value.light_set = static_cast<std::uint32_t>(from->integer("light_set", 0, last));
        }
        read_ripples(*from, value);
        from->reject_unknown_keys();
        out_.water = value;
    }

    const JsonObject &root_;
    SceneFile &out_;
};

} // namespace

bool SceneFile::is_trimmed() const {
    return (terrain && terrain->trimmed_patches > 0) ||
           std::ranges::any_of(artifacts,
                               [](const Artifact &artifact) { return artifact.trimmed_levels > 0; });
}

const Artifact *SceneFile::find_artifact(std::string_view artifact) const {
    const auto found = std::ranges::lower_bound(artifacts, artifact, {}, &Artifact::name);
    return found == artifacts.end() || found->name != artifact ? nullptr : &*found;
}

SceneFile parse_scene(std::string_view text, const std::filesystem::path &file) {
    const JsonDocument document(text, file.string());
    const JsonObject root = document.root();
    SceneFile out;
    SceneReader(root, out).read();
    return out;
}

SceneFile read_scene(const std::filesystem::path &file) {
    const FileBytes held(file, {.max = max_json_bytes});
    const auto bytes = held.bytes();
    try {
        return parse_scene({reinterpret_cast<const char *>(bytes.data()), bytes.size()}, file);
    } catch (const Error &error) { // whatever is wrong in it, a bake writes it anew
        throw Error(with_bake_again(error.what()));
    }
}

} // namespace paradize::assets
