// A terrain of two patches, one in place of the other where it splits: its needs and looks at the water.

#include "context.hpp"
#include "files.hpp"
#include "gl/framebuffer.hpp"
#include "gl/program.hpp"
#include "gl/shader_library.hpp"
#include "gl/texture.hpp"
#include "scene/camera.hpp"
#include "small_scene.hpp"
#include "streaming/demand.hpp"
#include "streaming/scene.hpp"
#include "streaming/streamer.hpp"
#include "streaming/terrain_tiles.hpp"
#include "streaming/uploads.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <tuple>
#include <vector>

using namespace paradize;
using paradize::test::SmallScene;

namespace {

/// Flat ground at a height of 0 in one tile: patch 0, and patch 1 in its place where its diamond splits.
struct FlatGround : SmallScene {
    FlatGround() {
        file.objects.clear();
        file.shadow.reset();
        std::string json = test::glb_json(false);
        json = test::replaced(json, R"("name":"lod0","mesh":0)", R"("name":"patch0","mesh":1)");
        json = test::replaced(json, R"("name":"lod1")", R"("name":"patch1")");
        put("quad_mesh", test::glb_file(json));
        assets::Terrain &terrain = file.terrain.emplace();
        terrain.tiles = {"quad_mesh"};
        terrain.patches = {.tile = {0, 0},
                           .node = {0, 1},
                           .level = {0, 1},
                           .parent_diamond = {-1, 0},
                           .diamond = {0, -1},
                           .center = {glm::vec3(0.0F), glm::vec3(0.0F)},
                           .radius_m = {1.0F, 1.0F},
                           .error_m = {0.1F, 0.0F}};
        terrain.diamonds = {.level = {0}, .error_m = {0.1F}, .center = {glm::vec3(0.0F)}, .radius_m = {0.0F}};
    }
};

assets::Water water_at(float level_m, float swash_height_m = 0.0F) {
    assets::Water out;
    out.level_m = level_m;
    out.swash_height_m = swash_height_m;
    return out;
}

/// A picture from (0, 1, 6) in which the diamond's error is this share of the accepted one.
CameraForecast seen_with_error(SmallScene &scene, float share) {
    CameraForecast out{.settings = render_settings(scene.file, all_at(Tier::balanced), Device()),
                       .width_px = 160,
                       .height_px = 90,
                       .now = {{0.0, 1.0, 6.0}, {0.0, 0.0, 0.0}}};
    const float pixels_per_m = 45.0F / std::tan(0.5F * scene.file.flight.fov_rad) / std::sqrt(37.0F);
    scene.file.terrain->diamonds.error_m = {share * out.settings.lod_error_px / pixels_per_m};
    return out;
}

} // namespace

TEST_CASE("terrain: a patch is dry above what waves reach, sunken below what is wet or mirrors, else at the "
          "shore") {
    if (!test::have_context()) {
        return;
    }
    const FlatGround scene;
    const Streamer streamer = scene.streamer();
    const auto kind = [&](const assets::Water &water) {
        return patch_heights(*scene.file.terrain, streamer, water)[0];
    };
    CHECK(kind(water_at(-0.02F)) == PatchKind::dry);
    CHECK(kind(water_at(-0.5F, 0.4F)) == PatchKind::dry);
    CHECK(kind(water_at(-0.5F, 0.42F)) == PatchKind::shore); // waves run up by 1.2 of their height
    CHECK(kind(water_at(0.0F)) == PatchKind::shore);
    CHECK(kind(water_at(0.16F)) == PatchKind::shore);
    CHECK(kind(water_at(0.18F)) == PatchKind::sunken);
}

TEST_CASE(
    "terrain: the halves of a diamond at the waterline are needed before they fade in, others when they "
    "are seen") {
    if (!test::have_context()) {
        return;
    }
    for (const auto &[level_m, share, needed] :
         {std::tuple(0.0F, 0.8F, false), {0.0F, 0.9F, true}, {-1.0F, 0.9F, false}, {-1.0F, 1.1F, true}}) {
        FlatGround scene;
        scene.file.water = water_at(level_m);
        const CameraForecast forecast = seen_with_error(scene, share);
        const Streamer streamer = scene.streamer();
        const Scene placed(scene.file, streamer);
        Demand demand(placed, streamer);
        demand.update(forecast);
        const auto [first, count] = streamer.pieces_of("quad_mesh");
        REQUIRE(count == 2);
        CHECK(demand.needs()[first].now > 1.0F); // the root
        CHECK((demand.needs()[first + 1].now > 1.0F) == needed);
    }
}

TEST_CASE("terrain: a patch behind the eye is needed where it casts a shadow") {
    if (!test::have_context()) {
        return;
    }
    for (const bool shadows : {true, false}) {
        FlatGround scene;
        if (shadows) {
            scene.file.shadow.emplace(); // 100 m round the origin
        }
        CameraForecast forecast = seen_with_error(scene, 1.1F);
        forecast.now.target = {0.0, 1.0, 20.0};
        const Streamer streamer = scene.streamer();
        const Scene placed(scene.file, streamer);
        Demand demand(placed, streamer);
        demand.update(forecast);
        const std::uint32_t finer = streamer.pieces_of("quad_mesh").first + 1;
        CHECK((demand.needs()[finer].now > 1.0F) == shadows);
    }
}

TEST_CASE("terrain: the shadow map shows one side of a fade, that of its middle") {
    if (!test::have_context()) {
        return;
    }
    for (const float share : {0.88F, 0.97F}) { // the fade goes from 0.85 to 1
        FlatGround scene;
        const CameraForecast forecast = seen_with_error(scene, share);
        Streamer streamer = scene.streamer();
        streamer.upload({});
        TerrainTiles tiles(*scene.file.terrain, streamer);
        tiles.set_water(water_at(0.0F));
        const View main = main_view(forecast.now, scene.file.flight, forecast.width_px, forecast.height_px);
        tiles.update(main, forecast.settings.lod_error_px);
        CHECK(tiles.sees(main, no_plane, 0));
        CHECK(tiles.sees(main, no_plane, 1));
        View light; // planes of zero cull nothing
        light.kind = ViewKind::light;
        CHECK(tiles.sees(light, no_plane, 0) == (share < 0.9F));
        CHECK(tiles.sees(light, no_plane, 1) == (share > 0.9F));
    }
}

TEST_CASE("terrain: the refraction view sees what it lifts into view, other views where it is") {
    View view;
    view.planes[0] = {0.0F, 1.0F, 0.0F, 2.0F}; // keeps what is above -2
    for (const ViewKind kind : {ViewKind::main, ViewKind::refraction}) {
        view.kind = kind;
        CHECK(patch_in_view(view, {0.0, -2.5, 0.0}, 1.0F, 0.0));
        CHECK(patch_in_view(view, {0.0, -9.0, 0.0}, 1.0F, 0.0) == (kind == ViewKind::refraction));
        CHECK_FALSE(patch_in_view(view, {0.0, -9.0, 0.0}, 1.0F, -5.0));
    }
}

TEST_CASE("terrain: patches of lit sets are drawn with the block of uniforms that holds their set") {
    if (!test::have_context()) {
        return;
    }
    FlatGround scene;
    assets::Terrain &terrain = *scene.file.terrain;
    terrain.diamonds = {};
    terrain.patches.level = {0, 0}; // two roots
    terrain.patches.parent_diamond = terrain.patches.diamond = {-1, -1};
    terrain.light_sets = {2, 5};
    Streamer streamer = scene.streamer();
    streamer.upload({});
    TerrainTiles tiles(terrain, streamer);
    View view; // planes of zero cull nothing
    tiles.update(view, 1.0F);
    const gl::ShaderLibrary shaders(gl::ShaderLibrary::find());
    const gl::Program program(shaders, "depth.vert", "depth.frag");
    program.use();
    const gl::Texture color = gl::make_target(GL_RGBA8, 1, 1);
    const gl::Framebuffer framebuffer = gl::make_framebuffer(color, {});
    gl::bind_framebuffer(framebuffer.name(), 1, 1);
    const std::vector<std::uint8_t> lit{0, 0, 1, 0, 0, 1};
    std::vector<std::uint32_t> blocks;
    const PatchLights lights{lit, true, 2, [&](std::uint32_t block) { blocks.push_back(block); }};
    tiles.choose(view, no_plane, all_patches, &lights);
    tiles.draw(view, {program.location("u_model")}, &lights);
    CHECK(blocks == std::vector<std::uint32_t>{1, 2});
    test::throw_on_error();
}

TEST_CASE(
    "terrain: patches share pages of a 64th of the limit, and a 16th is kept for what is unused of them") {
    FlatGround scene;
    std::ranges::find(scene.file.artifacts, "quad_mesh", &assets::Artifact::name)->bytes = 100'000'000;
    const PatchPages ample = patch_pages(scene.file, 0);
    CHECK(ample.page_bytes == std::uint64_t{16} << 20U);
    CHECK(ample.reserve_bytes == 0);
    const PatchPages limited = patch_pages(scene.file, 640'000'000);
    CHECK(limited.page_bytes == 10'000'000);
    CHECK(limited.reserve_bytes == 40'000'000);
    CHECK(limited.slack_bytes == limited.reserve_bytes);
    const PatchPages little = patch_pages(scene.file, 64'000'000); // pages below 1 MiB are none
    CHECK(little.page_bytes == 0);
    CHECK(little.reserve_bytes == 0);
    scene.file.terrain.reset();
    CHECK(patch_pages(scene.file, 640'000'000).reserve_bytes == 0);
}

TEST_CASE("terrain: a tile is taken over from the scene before where its patches are those of the new one") {
    if (!test::have_context()) {
        return;
    }
    const FlatGround ground;
    Streamer before = ground.streamer();
    before.finish_checks();
    before.upload({});
    assets::SceneFile next = ground.file;
    const auto load = [&] { return SceneLoad(next, ground.folder.path(), &before); };
    CHECK(Streamer(next, load()).reused() == next.artifacts.size());
    next.terrain->diamonds = {};
    next.terrain->patches = {.tile = {0},
                             .node = {0},
                             .level = {0},
                             .parent_diamond = {-1},
                             .diamond = {-1},
                             .center = {glm::vec3(0.0F)},
                             .radius_m = {1.0F},
                             .error_m = {0.0F}};
    const Streamer after(next, load());
    CHECK(after.reused() == next.artifacts.size() - 1);
    CHECK(after.tile(0).blocks().size() == 1);
    test::throw_on_error();
}
