#include "assets/scene/file.hpp"
#include "error.hpp"
#include "files.hpp"

#include <doctest/doctest.h>

#include <string>

using namespace paradize;

namespace {

/// Two roots that form one diamond, and its four children, in two tiles.
const char *const tiled = R"({"tiles": ["quad_mesh", "more_mesh"],
"patches": {"tile": [0, 0, 0, 1, 1, 1], "node": [0, 1, 2, 0, 1, 2], "level": [0, 0, 1, 1, 1, 1],
 "made_by": [-1, -1, 0, 0, 0, 0], "diamond": [0, 0, -1, -1, -1, -1],
 "center": [[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0], [4, 0, 0], [5, 0, 0]],
 "radius_m": [2, 2, 1, 1, 1, 1], "error_m": [0.5, 0.4, 0.1, 0.1, 0.1, 0.1]},
"diamonds": {"level": [0], "error_m": [0.6], "center": [[0.5, 0, 0]], "radius_m": [8]},
"demand": {"finest_level": 1, "finest_s": 0.5, "left_out": 3, "left_out_bytes": 4},
"sand_color": "quad_color", "sand_repeat": 8, "mix_low_m": 0, "mix_high_m": 1, "size_m": [9, 9],
"height_range_m": [0, 1]})";

std::string scene_with(std::string terrain) {
    std::string text = test::SceneText().str();
    const std::string none = "\"terrain\": null";
    text.replace(text.find(none), none.size(), "\"terrain\": " + terrain);
    text.insert(text.find(R"("quad_mesh": {"file")"),
                R"("more_mesh": {"file": "more_mesh.glb", "kind": "mesh", )" +
                    test::identity(test::Bytes(1)) + "}, ");
    return text;
}

} // namespace

TEST_CASE("terrain: reads the highest ground of a grid, in whole rows") {
    const std::string floor = R"("floor": {"columns": 2, "cell_m": [3, 4], "highest_m": [1, -2, 0.5, 0]}, )";
    const std::string text = test::replaced(tiled, "\"sand_color\"", floor + "\"sand_color\"");
    const assets::SceneFile scene = assets::parse_scene(scene_with(text), "scene.json");
    CHECK(scene.terrain->floor.rows == 2);
    CHECK(scene.terrain->floor.highest_m[1] == -2.0F);
    CHECK_THROWS_AS(assets::parse_scene(scene_with(test::replaced(text, "0.5, 0]", "0.5]")), "scene.json"),
                    Error);
}

TEST_CASE("terrain: its tables are read as written") {
    const assets::SceneFile scene = assets::parse_scene(scene_with(tiled), "scene.json");
    REQUIRE(scene.terrain);
    const assets::Terrain &terrain = *scene.terrain;
    CHECK(terrain.tiles == std::vector<std::string>{"quad_mesh", "more_mesh"});
    CHECK(terrain.patches.size() == 6);
    CHECK(terrain.patches.tile[3] == 1);
    CHECK(terrain.patches.node[5] == 2);
    CHECK(terrain.patches.parent_diamond[1] == -1);
    CHECK(terrain.patches.diamond[1] == 0);
    CHECK(terrain.patches.center[4] == glm::vec3(4.0F, 0.0F, 0.0F));
    CHECK(terrain.patches.error_m[1] == 0.4F);
    CHECK(terrain.diamonds.size() == 1);
    CHECK(terrain.diamonds.radius_m[0] == 8.0F);
    CHECK(terrain.trimmed_patches == 3);
}

TEST_CASE("terrain: tables that are not a tree are rejected with their path") {
    struct Broken {
        const char *from, *to, *message;
    };
    for (const auto &[from, to, message] : {
             Broken{"\"more_mesh\"]", "\"quad_mesh\"]", "tiles[1]: names \"quad_mesh\" twice"},
             Broken{"\"more_mesh\"]", "\"sky\"]",
                    "tiles[1]: names \"sky\", which is not an artifact of the right kind"},
             Broken{"[\"quad_mesh\", \"more_mesh\"]", "[]", "tiles: is empty"},
             Broken{"[0, 0, 0, 1, 1, 1]", "[0, 0, 0, 2, 1, 1]", "patches.tile[3]: is 2, must lie in [0, 1]"},
             Broken{"[0, 0, 0, 1, 1, 1]", "[0, 0, 1, 0, 1, 1]", "patches.tile[3]: is 0, must not be below 1"},
             Broken{"[0, 1, 2, 0, 1, 2]", "[0, 1, 1, 0, 1, 2]",
                    "patches.node[2]: is 1, must be above the 1 before it"},
             Broken{"[0, 1, 2, 0, 1, 2]", "[0, 1, 2, 0, 1]",
                    "patches.node: has 5 entries, the columns before it have 6"},
             Broken{"[0, 0, 1, 1, 1, 1]", "[0, 1, 0, 1, 1, 1]",
                    "patches.level[2]: is 0, must not be below 1"},
             Broken{"[0, 0, 1, 1, 1, 1]", "[0, 0, 1, 1, 1, 2]",
                    "patches.made_by[5]: names a diamond of level 0, the patch has level 2"},
             Broken{"[-1, -1, 0, 0, 0, 0]", "[-1, -1, 0, 0, 0, -1]",
                    "patches.made_by[5]: is -1, a root, but the patch has level 1"},
             Broken{"[-1, -1, 0, 0, 0, 0]", "[-1, -1, 0, 0, 0, 1]",
                    "patches.made_by[5]: is 1, must lie in [-1, 0]"},
             Broken{"[0, 0, -1, -1, -1, -1]", "[0, 0, 0, -1, -1, -1]",
                    "patches.diamond[2]: names a diamond of level 0, the patch has level 1"},
             Broken{"[0, 0, -1, -1, -1, -1]", "[0, -1, -1, -1, -1, -1]",
                    "diamonds.level[0]: the diamond has 1 patches and 4 children"},
             Broken{"[0, 0, -1, -1, -1, -1]", "[-1, -1, -1, -1, -1, -1]",
                    "diamonds.level[0]: the diamond has 0 patches and 4 children"},
             Broken{"[3, 0, 0]", "[3, 0]", "patches.center[3]: must be an array of 3 entries"},
             Broken{"[2, 2, 1, 1, 1, 1]", "[2, 2, 1, -1, 1, 1]",
                    "patches.radius_m[3]: is -1, must lie in [0, 10000000]"},
             Broken{"\"left_out\": 3, ", "", "demand.left_out: is missing"},
             Broken{"\"demand\"", "\"demands\"", "demands: is unknown to this player"},
         }) {
        CHECK_THROWS_WITH_AS(assets::parse_scene(scene_with(test::replaced(tiled, from, to)), "scene.json"),
                             doctest::Contains((std::string("scene.json: terrain.") + message).c_str()),
                             Error);
    }
}

TEST_CASE("terrain: too many patches are rejected") {
    std::string many = "[0";
    for (int i = 0; i < 1 << 20; ++i) {
        many += ",0";
    }
    const std::string text = test::replaced(tiled, "\"tile\": [0, 0, 0, 1, 1, 1]", "\"tile\": " + many + "]");
    CHECK_THROWS_WITH_AS(assets::parse_scene(scene_with(text), "scene.json"),
                         doctest::Contains("terrain.patches.tile: must be an array of 0 to 1048576 entries"),
                         Error);
}
