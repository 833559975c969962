// The lights of a scene.json and their sets.

#include "assets/scene/file.hpp"
#include "error.hpp"
#include "files.hpp"

#include <doctest/doctest.h>

#include <string>

using namespace paradize;

namespace {

const std::string lamp = R"({"name": "lamp", "position": [1, 2, 3], "color": [1, 0.5, 0.25], "intensity": 4,
    "radius_m": 0.1, "range_m": 8, "hours": {"on_s": 3, "off_s": 1}, "fade_s": 0.5, "flicker": 0.2})";

/// A scene with a lamp, with these sets, of which the object's only instance has the one of this index.
assets::SceneFile parse(const std::string &sets, const std::string &index) {
    test::SceneText text;
    text.extra = "\"lights\": [" + lamp + "], \"light_sets\": [" + sets + "],";
    std::string whole = text.str();
    whole.insert(whole.find("\"sway\""), "\"light_sets\": [" + index + "], ");
    return assets::parse_scene(whole, "scene.json");
}

const std::string none = R"({"lights": [], "glow": null})";

} // namespace

TEST_CASE("scene.json: lights, their sets and the set of each instance are read") {
    const assets::SceneFile scene = parse(none + R"(, {"lights": [0], "glow": 0})", "1");
    REQUIRE(scene.lights.size() == 1);
    const assets::PointLight &light = scene.lights[0];
    CHECK(light.position == glm::dvec3(1.0, 2.0, 3.0));
    CHECK(light.color == glm::vec3(1.0F, 0.5F, 0.25F));
    CHECK(!light.always);
    CHECK(light.off_s == 1.0);
    REQUIRE(scene.light_sets.size() == 2);
    CHECK(scene.light_sets[1].glow == 0U);
    CHECK(scene.objects[0].light_sets == std::vector<std::uint32_t>{1});
    // A scene without lights has the empty set alone.
    CHECK(assets::parse_scene(test::SceneText().str(), "scene.json").light_sets.size() == 1);
}

TEST_CASE("scene.json: sets of lights that are not there, fall, or are too large are rejected") {
    CHECK_THROWS_AS(parse(none + R"(, {"lights": [1], "glow": null})", "1"), Error);
    CHECK_THROWS_AS(parse(none + R"(, {"lights": [0, 0], "glow": null})", "1"), Error);
    CHECK_THROWS_AS(parse(none + R"(, {"lights": [], "glow": 1})", "1"), Error);
    CHECK_THROWS_AS(parse(R"({"lights": [0], "glow": null})", "0"), Error); // must begin with no light
    CHECK_THROWS_AS(parse(none, "1"), Error);
    CHECK_THROWS_AS(parse(none, "0, 0"), Error);
    std::string many = "0";
    for (int i = 1; i <= 16; ++i) {
        many += ", " + std::to_string(i);
    }
    CHECK_THROWS_AS(parse(none + R"(, {"lights": [)" + many + R"(], "glow": null})", "1"), Error);
}
