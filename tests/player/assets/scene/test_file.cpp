#include "assets/scene/file.hpp"
#include "error.hpp"
#include "files.hpp"
#include "streaming/scene.hpp"

#include <doctest/doctest.h>

#include <array>
#include <ctime>
#include <string>

using namespace paradize;

namespace {

void check_refused(const test::SceneText &text, const std::string &message) {
    CHECK_THROWS_WITH_AS(assets::parse_scene(text.str(), "scene.json"), message.c_str(), Error);
}

} // namespace

TEST_CASE("scene.json: all values are read as written") {
    const assets::SceneFile scene = assets::parse_scene(test::SceneText().str(), "scene.json");
    CHECK(scene.name == "test");
    CHECK(scene.width_px == 64);
    CHECK(scene.sky == "sky");
    CHECK(scene.shadow->size_px == 64);
    CHECK(scene.reflection_scale == 0.5F);
    CHECK_FALSE(scene.refraction_scale.has_value());
    CHECK_FALSE(scene.water.has_value());
    REQUIRE(scene.objects.size() == 1);
    CHECK(scene.objects[0].lods[1].error_m == doctest::Approx(0.1));
    CHECK(scene.objects[0].materials[0].two_sided);
    CHECK(scene.objects[0].materials[0].vertex_lit);
    CHECK(scene.objects[0].materials[0].translucency == doctest::Approx(0.25));
    CHECK(scene.objects[0].instances[0].scale == glm::dvec3(2.0, 2.0, -3.0));
    CHECK(scene.objects[0].instances[0].rotation.w == doctest::Approx(0.8));
    CHECK(scene.objects[0].instances[0].rotation.y == doctest::Approx(0.6));
    CHECK(scene.artifacts[scene.streaming[0]].name == "sky");
    CHECK(scene.flight.segments.size() == 2);
    CHECK(scene.find_artifact("none") == nullptr);
    CHECK(scene.find_artifact("quad_color")->max_level == 3);
    CHECK_FALSE(scene.find_artifact("sky")->max_level.has_value());
    const assets::Material &leaf = scene.objects[0].materials[0];
    CHECK(leaf.wrap == std::array{assets::Wrap::clamp, assets::Wrap::mirror});
    CHECK(leaf.nearest);
    CHECK(leaf.parallax_limit == 0.25F);
    CHECK(leaf.opacity == 0.5F);
    CHECK(leaf.metalness == 0.25F);
    CHECK(leaf.emission == glm::vec3(1.0F, 2.0F, 3.0F));
    CHECK(leaf.occlusion_strength == 0.75F);
    CHECK(leaf.alpha_mode == assets::AlphaMode::mask);
    CHECK(leaf.vertex_colors);
    CHECK(leaf.maps[assets::ObjectMap::color] == "quad_color");
    CHECK(leaf.maps[assets::ObjectMap::occlusion].empty());
    CHECK(leaf.wind_reach == glm::vec2(0.5F, 0.25F));
    CHECK(scene.objects[0].reach_m == doctest::Approx(0.775));
    REQUIRE(scene.wind.has_value());
    CHECK(scene.wind->direction == glm::vec2(0.6F, -0.8F));
    CHECK(scene.wind->speed_m_per_s == 5.0F);
    CHECK(scene.wind->gust_m == 20.0F);
}

TEST_CASE("scene.json: largest picture, free camera's region and trimmed data are read") {
    test::SceneText text;
    CHECK(assets::parse_scene(text.str(), "scene.json").largest_width_px == 64);
    CHECK_FALSE(assets::parse_scene(text.str(), "scene.json").is_trimmed());
    text.extra = R"("largest_viewport": [640, 480],
        "free_camera": {"low": [-1, 0, -2], "high": [1, 3, 2], "near_m": 0.5},)";
    const assets::SceneFile scene = assets::parse_scene(text.str(), "scene.json");
    CHECK(scene.largest_width_px == 640);
    CHECK(scene.largest_height_px == 480);
    REQUIRE(scene.free_camera.has_value());
    CHECK(scene.free_camera->high.y == 3.0F);
    CHECK(scene.free_camera->near_m == 0.5F);
    CHECK((scene.objects[0].camera && scene.objects[0].shadow && scene.objects[0].reflection));
}

TEST_CASE("scene.json: another version is rejected with a remedy") {
    test::SceneText text;
    text.version = "3";
    check_refused(text,
                  "scene.json: version: is 3, this player reads version 10; bake the scene again with the "
                  "Paradize that came with the player");
}

TEST_CASE("scene.json: an unknown key is rejected by name") {
    test::SceneText text;
    text.extra = R"("moon": 1,)";
    check_refused(
        text,
        "scene.json: moon: is unknown to this player; bake the scene with the same version of Paradize");
}

TEST_CASE("scene.json: numbers out of range, dangling references and missing members are rejected with their "
          "path") {
    test::SceneText text;
    text.shadow = R"({"size": 0, "extent_m": 10, "center": [0, 0, 0]})";
    check_refused(text, "scene.json: shadow.size: is 0, must lie in [1, 16384]");
    text.shadow = R"({"size": 64, "extent_m": 10, "center": [0, "x", 0]})";
    check_refused(text, "scene.json: shadow.center[1]: must be a number, is string");
    text.shadow = R"({"size": 64, "center": [0, 0, 0]})";
    check_refused(text, "scene.json: shadow.extent_m: is missing");
    text.shadow = "null";
    text.extra = R"("light_shafts": {"density_per_m": 0.02, "anisotropy": 0.5, "range_m": 40},)";
    check_refused(text, "scene.json: light_shafts: stands without shadow, which it shows in the air");
    text.extra = "";
    text.color = R"("sky")";
    check_refused(
        text, "scene.json: objects[0].materials.leaf.maps.color: names \"sky\", which is not an artifact of "
              "the right kind");
    text.color = "null";
    text.streaming = R"(["nothing"])";
    check_refused(text, "scene.json: streaming: names \"nothing\", which is not an artifact");
}

TEST_CASE("scene.json: a number just beyond its limit is printed with enough digits") {
    test::SceneText text;
    text.shadow = R"({"size": 64, "extent_m": 10000000.000000002, "center": [0, 0, 0]})";
    check_refused(text, "scene.json: shadow.extent_m: is 10000000.000000002, must lie in [0.001, 10000000]");
}

TEST_CASE("scene.json: sounds and music are read as written, and refused with their path") {
    const std::string sounds = R"([{"name": "shore", "artifact": "a", "volume": 0.5, "radius_m": 3,
        "places": [[1, 2, 3], [4, 5, 6]], "falloff": 0.5, "hours": {"on_s": 9, "off_s": 1, "fade_s": 2}}])";
    const std::string music = R"({"artifacts": ["a", "a"], "volume": 0.25, "playing": 2})";
    std::string text = test::SceneText().str();
    text.replace(text.find("\"sounds\": [], \"music\": null"), 27,
                 "\"sounds\": " + sounds + ", \"music\": " + music);
    text.insert(text.find("\"sky\": {\"file\""),
                "\"a\": {\"file\": \"a\", \"kind\": \"sound\", " + test::identity(test::Bytes(1)) + "},\n");
    const assets::SceneFile scene = assets::parse_scene(text, "scene.json");
    REQUIRE(scene.sounds.size() == 1);
    CHECK(scene.sounds[0].artifact == "a");
    CHECK(scene.sounds[0].volume == 0.5F);
    CHECK(scene.sounds[0].places == std::vector{glm::dvec3(1.0, 2.0, 3.0), glm::dvec3(4.0, 5.0, 6.0)});
    CHECK(scene.sounds[0].radius_m == 3.0F);
    CHECK(scene.sounds[0].falloff == 0.5F);
    REQUIRE(scene.sounds[0].hours.has_value());
    CHECK(scene.sounds[0].hours->on_s == 9.0);
    CHECK(scene.sounds[0].hours->off_s == 1.0);
    CHECK(scene.sounds[0].hours->fade_s == 2.0);
    REQUIRE(scene.music.has_value());
    CHECK(scene.music->artifacts == std::vector<std::string>{"a", "a"});
    CHECK(scene.music->volume == 0.25F);
    CHECK(scene.music->playing == 2);
    for (const auto &[from, to, place] :
         {std::array<std::string, 3>{"\"artifact\": \"a\"", "\"artifact\": \"sky\"", "sounds[0].artifact"},
          {"\"radius_m\": 3", "\"radius_m\": 0", "sounds[0].radius_m"},
          {"[4, 5, 6]", "[4, 5]", "sounds[0].places[1]"},
          {"\"fade_s\": 2", "\"fade_s\": 0", "sounds[0].hours.fade_s"},
          {"\"hours\"", "\"ours\"", "sounds[0].ours"},
          {"[\"a\", \"a\"]", "[\"a\", \"sky\"]", "music.artifacts"},
          {"\"playing\": 2", "\"playing\": 3", "music.playing"}}) {
        std::string wrong = text;
        wrong.replace(wrong.find(from), from.size(), to);
        CHECK_THROWS_WITH_AS(assets::parse_scene(wrong, "scene.json"),
                             doctest::Contains(("scene.json: " + place + ": ").c_str()), Error);
    }
}

TEST_CASE("scene.json: an invalid level or limit is rejected with its path") {
    for (const auto &[from, to, place] :
         {std::array<std::string, 3>{"\"max_level\": 3", "\"max_level\": -1",
                                     "artifacts.quad_color.max_level"},
          {"\"max_level\": 3", "\"max_level\": 2.5", "artifacts.quad_color.max_level"},
          {"\"parallax_limit\": 0.25", "\"parallax_limit\": -0.1",
           "objects[0].materials.leaf.parallax_limit"},
          {"\"opacity\": 0.5", "\"opacity\": 1.5", "objects[0].materials.leaf.opacity"},
          {"\"metalness\": 0.25", "\"metalness\": -1", "objects[0].materials.leaf.metalness"},
          {"\"emission\": [1, 2, 3]", "\"emission\": [1, 2]", "objects[0].materials.leaf.emission"},
          {"\"alpha_mode\": \"mask\"", "\"alpha_mode\": \"glass\"", "objects[0].materials.leaf.alpha_mode"},
          {"\"occlusion\": null", "\"shine\": null", "objects[0].materials.leaf.maps.shine"},
          {"[0, 0.6, 0, 0.8]", "[0, 0.6, 0, 0.9]", "objects[0].instances[0].rotation"},
          {"[2, 2, -3]", "[2, 0, -3]", "objects[0].instances[0].scale"},
          {"[2, 2, -3]", "[2, 2e7, -3]", "objects[0].instances[0].scale[1]"}}) {
        std::string text = test::SceneText().str();
        text.replace(text.find(from), from.size(), to);
        CHECK_THROWS_WITH_AS(assets::parse_scene(text, "scene.json"),
                             doctest::Contains(("scene.json: " + place + ": ").c_str()), Error);
    }
}

TEST_CASE("scene.json: keys of the light are read as written, and refused where they cannot be played") {
    const auto keys = [](const std::string &first_s, const std::string &second_s, const std::string &sky) {
        const auto light = [](const std::string &intensity) {
            return R"({"azimuth_rad": 1, "elevation_rad": 0.5, "color": [1, 1, 1], "intensity": )" +
                   intensity + "}";
        };
        const auto key = [&](const std::string &at_s) {
            return R"({"at_s": )" + at_s + R"(, "sun": )" + light("3") + R"(, "moon": )" + light("0") +
                   R"(, "ambient": {"color": [1, 1, 1], "intensity": 0.25},
"fog": {"color": [1, 1, 1], "density_per_m": 0.5}, "exposure": 2, "cubemap": ")" +
                   sky + R"(", "cubemap_azimuth_rad": -1})";
        };
        return R"("daytime": {"keys": [)" + key(first_s) + ", " + key(second_s) +
               R"(], "moon_diameter_rad": 0.02, "clouds": {"color": "quad_color", "high_rad": 0.4, "repeat": 3,
"drift_repeats": -2}}, )";
    };
    test::SceneText text;
    text.extra = keys("0.5", "4", "sky");
    const assets::SceneFile scene = assets::parse_scene(text.str(), "scene.json");
    REQUIRE(scene.daytime.size() == 2);
    CHECK(scene.daytime[1].at_s == 4.0);
    CHECK(scene.daytime[1].sun.intensity == 3.0F);
    CHECK(scene.daytime[1].moon.elevation_rad == 0.5F);
    CHECK(scene.daytime[1].ambient.intensity == 0.25F);
    CHECK(scene.daytime[1].fog.density_per_m == 0.5F);
    CHECK(scene.daytime[1].exposure == 2.0F);
    CHECK(scene.daytime[1].sky_azimuth_rad == -1.0F);
    CHECK(scene.clouds->drift_repeats == -2);
    text.extra = keys("4", "4", "sky");
    check_refused(text,
                  "scene.json: daytime.keys[1].at_s: is 4, must be above that of the key before and below "
                  "the flight's 10 s");
    text.extra = keys("4", "10", "sky");
    check_refused(text,
                  "scene.json: daytime.keys[1].at_s: is 10, must be above that of the key before and below "
                  "the flight's 10 s");
    text.extra = keys("1", "4", "quad_color");
    check_refused(text,
                  "scene.json: daytime.keys[0].cubemap: names \"quad_color\", which is not an artifact of "
                  "the right kind");
}

TEST_CASE("parallax: kept within the limit, scaled down as a whole beyond it") {
    assets::Material material;
    material.parallax_scale = 0.2F;
    material.parallax_bias = -0.1F; // displaces by up to 0.2
    CHECK(parallax_of(material) == glm::vec2(0.2F, -0.1F));
    material.parallax_limit = 0.3F;
    CHECK(parallax_of(material) == glm::vec2(0.2F, -0.1F));
    material.parallax_limit = 0.05F;
    const glm::vec2 held = parallax_of(material);
    CHECK(held.x == doctest::Approx(0.05F));
    CHECK(held.y == doctest::Approx(-0.025F));
    material.parallax_limit = 0.0F;
    CHECK(parallax_of(material) == glm::vec2(0.0F));
    material.parallax_scale = material.parallax_bias = 0.0F;
    CHECK(parallax_of(material) == glm::vec2(0.0F)); // no division by zero
}

TEST_CASE("scene.json: a text truncated anywhere is rejected") {
    const std::string text = test::SceneText().str();
    for (std::size_t length = 0; length < text.size(); length += 7) {
        CHECK_THROWS_AS(assets::parse_scene(text.substr(0, length), "scene.json"), Error);
    }
}

TEST_CASE("scene.json: files outside the scene's folder are rejected") {
    std::string text = test::SceneText().str();
    text.replace(text.find("sky.ktx2"), 8, "../x.ktx");
    CHECK_THROWS_WITH_AS(
        assets::parse_scene(text, "scene.json"),
        "scene.json: artifacts.sky.file: \"../x.ktx\" must be a path inside the scene's folder", Error);
}

TEST_CASE("scene.json: ten times as many artifacts take some ten times as long") {
    const auto text_of = [](int count) {
        std::string artifacts;
        std::string streaming = "[";
        const std::string same = test::identity(test::Bytes(1));
        for (int i = 0; i < count; ++i) {
            const std::string name = "\"a" + std::to_string(i) + "\"";
            artifacts += name + ": {\"file\": \"a\", \"kind\": \"sound\", " + same + "},\n";
            streaming += (i == 0 ? "" : ",") + name;
        }
        test::SceneText text;
        text.streaming = streaming + "]";
        std::string whole = text.str();
        whole.insert(whole.find("\"sky\": {\"file\""), artifacts);
        return whole;
    };
    // The processor's time, the least of three: others may use it too.
    const auto least_time = [](const std::string &text) {
        std::clock_t least = std::numeric_limits<std::clock_t>::max();
        for (int turn = 0; turn < 3; ++turn) {
            const std::clock_t start = std::clock();
            (void)assets::parse_scene(text, "scene.json");
            least = std::min(least, std::clock() - start);
        }
        return least;
    };
    const std::string many = text_of(50000);
    CHECK(least_time(many) < 30 * least_time(text_of(5000))); // where each looks at all others, 100 times
    const assets::SceneFile scene = assets::parse_scene(many, "scene.json");
    REQUIRE(scene.find_artifact("a49999") != nullptr);
    CHECK(scene.artifacts[scene.streaming[777]].name == "a777");
}

TEST_CASE("scene.json: too many particles in all fields together are rejected") {
    const std::string field = R"({"name": "s", "center": [0, 0, 0], "radius_m": 1, "count": 600000,
        "size_m": [1, 1], "life_per_s": [1, 1], "threshold": 0.1, "color": [1, 1, 1]})";
    std::string text = test::SceneText().str();
    text.replace(text.find("\"particles\": []"), 15, "\"particles\": [" + field + "," + field + "]");
    CHECK_THROWS_WITH_AS(
        assets::parse_scene(text, "scene.json"),
        "scene.json: particles[1].count: makes more than 1000000 particles in all fields together", Error);
}

TEST_CASE("scene.json: too many instances in all objects together are rejected") {
    std::string text = test::SceneText().str();
    const std::string one = R"({"position": [0, 0, 0], "rotation": [0, 0.6, 0, 0.8], "scale": [2, 2, -3]})";
    const std::size_t at = text.find(one);
    REQUIRE(at != std::string::npos);
    std::string more;
    for (int i = 0; i < 200000; ++i) {
        more += R"({"position": [1, 2, 3]},)";
    }
    text.insert(at, more);
    CHECK_THROWS_WITH_AS(assets::parse_scene(text, "scene.json"), doctest::Contains("200000"), Error);
}

TEST_CASE("scene.json: invalid JSON gives the player's own message") {
    CHECK_THROWS_WITH_AS(assets::parse_scene("{\"a\" 1}", "scene.json"),
                         doctest::Contains("scene.json: is not valid JSON"), Error);
}

TEST_CASE("scene.json: deep nesting is rejected without a crash") {
    std::string deep = "{\"format\":";
    deep.append(200000, '[');
    CHECK_THROWS_AS(assets::parse_scene(deep, "scene.json"), Error);
}
