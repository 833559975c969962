#include "context.hpp"
#include "files.hpp"
#include "small_scene.hpp"
#include "streaming/demand.hpp"
#include "streaming/scene.hpp"
#include "streaming/streamer.hpp"

#include <doctest/doctest.h>
#include <glm/geometric.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

using namespace paradize;
using paradize::test::SmallScene;

namespace {

const Pose towards{{0.0, 1.0, 6.0}, {0.0, 0.0, 0.0}};
const Pose away{{0.0, 1.0, 6.0}, {0.0, 1.0, 20.0}};

CameraForecast forecast_of(const SmallScene &scene, const Pose &now) {
    return {.settings = render_settings(scene.file, all_at(Tier::balanced), Device()),
            .width_px = 160,
            .height_px = 90,
            .now = now,
            .soon = {away, away, away, away}};
}

/// Pixels per metre at a distance of one metre.
float pixels_at_1m(const SmallScene &scene) {
    return 90.0F / (2.0F * std::tan(0.5F * scene.file.flight.fov_rad));
}

/// How much the piece whose finest mip or level this is is needed in a picture from `towards`.
float need_now(const SmallScene &small, const std::string &artifact, std::uint32_t level,
               float mip_bias = 0.0F) {
    const Streamer streamer = small.streamer();
    const Scene scene(small.file, streamer);
    Demand demand(scene, streamer);
    CameraForecast forecast = forecast_of(small, towards);
    forecast.settings.mip_bias = mip_bias;
    demand.update(forecast);
    const auto [first, count] = streamer.pieces_of(artifact);
    for (std::uint32_t i = first; i < first + count; ++i) {
        if (streamer.piece(i).first_level == level) {
            return demand.needs()[i].now;
        }
    }
    FAIL("no such piece");
    return 0.0F;
}

} // namespace

TEST_CASE("demand: where files are read slowly it looks further ahead, up to four times as far") {
    CHECK(horizons_for(0.0) == near_horizons_s);
    CHECK(horizons_for(2e9) == near_horizons_s);
    CHECK(horizons_for(5e7) == Horizons{2.0, 4.0, 8.0, 16.0});
    CHECK(horizons_for(1e5) == Horizons{4.0, 8.0, 16.0, 32.0});
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    small.file.shadow.reset();
    const Streamer streamer = small.streamer();
    const Scene scene(small.file, streamer);
    Demand demand(scene, streamer);
    CameraForecast forecast = forecast_of(small, away);
    forecast.soon.back() = towards;
    forecast.horizons_s = horizons_for(1e5);
    demand.update(forecast); // in 32 s
    forecast.soon.fill(away);
    for (forecast.elapsed_s = 1.0; forecast.elapsed_s < 36.0; ++forecast.elapsed_s) {
        demand.update(forecast);
        const bool is_needed = demand.needs()[streamer.pieces_of("quad_mesh").first].soon > 1.0F;
        CHECK((is_needed || forecast.elapsed_s > 32.0));
        CHECK((!is_needed || forecast.elapsed_s < 36.0));
    }
}

TEST_CASE("demand: what a look ahead glimpses is needed until its time has come, and ever more") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    small.file.shadow.reset(); // casts one also while it is not seen
    const Streamer streamer = small.streamer();
    const Scene scene(small.file, streamer);
    const std::uint32_t mesh = streamer.pieces_of("quad_mesh").first;
    for (const bool steered : {false, true}) {
        Demand demand(scene, streamer);
        CameraForecast forecast = forecast_of(small, away);
        forecast.soon[1] = towards; // in two seconds
        forecast.steered = steered;
        demand.update(forecast);
        const float first = demand.needs()[mesh].soon;
        float before = first;
        CHECK(demand.needs()[mesh].now == 0.0F);
        REQUIRE(before > 1.0F);
        forecast.soon.fill(away);
        for (int frame = 1; frame < 180; ++frame) {
            forecast.elapsed_s = frame / 30.0;
            demand.update(forecast);
            const float soon = demand.needs()[mesh].soon;
            if (steered) {
                CHECK(soon <= before); // a guess that fades
            } else {
                CHECK((forecast.elapsed_s > 2.0 || soon >= before));
            }
            before = soon;
        }
        CHECK(before <= (steered ? 0.1F * first : 0.0F)); // the guess has faded, or its time has passed
    }
}

TEST_CASE("demand: what is seen after some seconds counts the less the later, by 1 / (1 + s)") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    small.file.shadow.reset();
    const Streamer streamer = small.streamer();
    const Scene scene(small.file, streamer);
    const std::uint32_t mesh = streamer.pieces_of("quad_mesh").first;
    CameraForecast forecast = forecast_of(small, towards);
    Demand seen(scene, streamer);
    seen.update(forecast);
    const float error = seen.needs()[mesh].now;
    REQUIRE(error > 2.0F);
    forecast.now = away;
    for (std::size_t i = 0; i < forecast.soon.size(); ++i) {
        forecast.soon.fill(away);
        forecast.soon[i] = towards;
        Demand later(scene, streamer);
        later.update(forecast);
        const double share = 1.0 / (1.0 + near_horizons_s[i]);
        CHECK(later.needs()[mesh].soon ==
              doctest::Approx(1.0 + (static_cast<double>(error) - 1.0) * share).epsilon(1e-4));
    }
}

TEST_CASE("demand: an object behind the eye is needed where it casts a shadow") {
    if (!test::have_context()) {
        return;
    }
    for (const bool shadows : {true, false}) {
        SmallScene small;
        if (!shadows) {
            small.file.shadow.reset();
        }
        const Streamer streamer = small.streamer();
        const Scene scene(small.file, streamer);
        Demand demand(scene, streamer);
        demand.update(forecast_of(small, away));
        for (const char *artifact : {"quad_mesh", "quad_color"}) {
            CHECK((demand.needs()[streamer.pieces_of(artifact).first].now > 1.0F) == shadows);
        }
    }
}

TEST_CASE(
    "demand: a level of detail is needed by the error of the next coarser one, the coarsest by its size") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    small.file.shadow.reset();
    small.file.lod_error_px = 0.5F;
    const Streamer streamer = small.streamer();
    const Scene scene(small.file, streamer);
    const Instance &quad = scene.objects()[0].instances[0];
    const auto distance_m = static_cast<float>(glm::distance(towards.eye, quad.center)) - quad.radius_m;
    const float accepted = pixels_at_1m(small) * quad.scale / std::max(distance_m, small.file.flight.near_m) /
                           small.file.lod_error_px;
    CHECK(need_now(small, "quad_mesh", 0) == doctest::Approx(0.1F * accepted));
    CHECK(need_now(small, "quad_mesh", 1) == doctest::Approx(1.5F * accepted));
}

TEST_CASE(
    "demand: a mip is needed by the size of the next coarser texel in pixels, on the sea, in the sky, in "
    "clouds") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    small.file.objects.clear();
    small.file.shadow.reset();
    small.put("quad_color", test::ktx2_file(assets::PixelFormat::rgba8_unorm, 256, 128));
    const float pixels = pixels_at_1m(small);
    SUBCASE("the sea's: the texels are as far away as the eye is high over the water") {
        assets::Water &water = small.file.water.emplace();
        water.normal = water.dudv = "quad_color";
        water.level_m = -3.0F; // 4 m below the eye
        water.size_m = 512.0F;
        water.wave_repeat = 16.0F; // the shorter side has 128 texels: 4 a metre
        CHECK(need_now(small, "quad_color", 0) == doctest::Approx(2.0F * pixels / (4.0F * 4.0F)));
        CHECK(need_now(small, "quad_color", 1) == doctest::Approx(4.0F * pixels / (4.0F * 4.0F)));
    }
    SUBCASE(
        "the ground's: as far away as the eye is high over its highest point, and the coarse mips always") {
        assets::Terrain &terrain = small.file.terrain.emplace();
        terrain.sand_color = "quad_color";
        terrain.size_m = {64.0F, 32.0F};
        terrain.height_range_m = {-9.0F, -1.0F}; // 2 m below the eye
        terrain.sand_repeat = 2.0F;
        CHECK(need_now(small, "quad_color", 0) == doctest::Approx(2.0F * pixels / (2.0F * 4.0F)));
        terrain.sand_repeat = 1e6F;
        CHECK(need_now(small, "quad_color", 0) < 1.0F);
        const float coarse = need_now(small, "quad_color", 2);
        CHECK(coarse > 1.0F);
        CHECK(coarse < 1.001F);
    }
    SUBCASE("both skies between two keys, and the clouds") {
        small.file.daytime.resize(2);
        small.file.daytime[1].at_s = 5.0;
        for (const std::size_t changed : {0U, 1U}) { // 8 texels an edge, all in one piece
            small.file.daytime[changed].sky = "sky";
            small.file.daytime[1 - changed].sky = "";
            CHECK(need_now(small, "sky", 0) == doctest::Approx(16.0F * pixels / (0.5F * 8.0F)));
        }
        small.file.daytime[0].sky = small.file.daytime[1].sky = "sky";
        small.file.clouds = assets::Clouds{.map = "quad_color", .repeat = 2};
        const float texels_per_rad = 2.0F * 256.0F / 6.2831853F;
        CHECK(need_now(small, "quad_color", 0) == doctest::Approx(2.0F * pixels / texels_per_rad));
    }
}

TEST_CASE("demand: maps are needed as finely as their texture coordinates and the bias of mips spread them") {
    if (!test::have_context()) {
        return;
    }
    // Both levels have two sets of coordinates: a metre is 4 wide in the first, 1 in the second.
    std::string json = test::glb_json();
    json = test::replaced(json, R"("POSITION":0,"NORMAL":1},"indices":2)",
                          R"("POSITION":0,"NORMAL":1,"TEXCOORD_0":5,"TEXCOORD_1":5},"indices":2)");
    json = test::replaced(json, R"("POSITION":4})", R"("POSITION":4,"TEXCOORD_0":6,"TEXCOORD_1":6})");
    json = test::replaced(json, R"(],
"bufferViews")",
                          R"(,{"bufferView":0,"componentType":5126,"count":4,"type":"VEC2"},
{"bufferView":0,"componentType":5126,"count":3,"type":"VEC2"}],
"bufferViews")");
    json = test::replaced(json, R"("center":[0,0,0]})", R"("center":[0,0,0],"uv_per_m":4,"uv1_per_m":1})");
    const auto need = [&](assets::ObjectMap map, float mip_bias = 0.0F) {
        SmallScene small;
        small.file.shadow.reset();
        small.put("quad_mesh", test::glb_file(json));
        assets::Material &material = small.file.objects[0].materials[0];
        material = {};
        material.name = "wood";
        material.maps[map] = "quad_color";
        return need_now(small, "quad_color", 0, mip_bias);
    };
    const float first = need(assets::ObjectMap::normal);
    CHECK(first > 0.0F);
    CHECK(need(assets::ObjectMap::second_normal) == doctest::Approx(4.0F * first));
    CHECK(need(assets::ObjectMap::normal, 1.0F) == doctest::Approx(0.5F * first));
}
