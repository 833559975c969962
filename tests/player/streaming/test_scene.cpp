#include "context.hpp"
#include "error.hpp"
#include "small_scene.hpp"
#include "streaming/scene.hpp"
#include "streaming/streamer.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <optional>
#include <tuple>
#include <vector>

using namespace paradize;
using paradize::test::SmallScene;

TEST_CASE("scene: visible instances are collected with a resident level, hidden ones are not") {
    if (!test::have_context()) {
        return;
    }
    const SmallScene small;
    Streamer streamer = small.streamer();
    const Scene scene(small.file, streamer);
    CHECK(scene.instance_count() == 1);
    CHECK(scene.objects()[0].materials[1].values.two_sided);       // leaf: found by name
    CHECK_FALSE(scene.objects()[0].materials[0].values.two_sided); // wood: default values
    View view;                                                     // planes of zero cull nothing
    std::vector<DrawItem> items;
    items.reserve(scene.instance_count());
    scene.collect(view, {0.0F, 0.0F, 5.0F}, 400.0F, 1.0F, items);
    CHECK(items.empty());             // nothing is resident
    streamer.upload({.bytes = 2200}); // the sky and the coarsest level of the mesh
    scene.collect(view, {0.0F, 0.0F, 5.0F}, 400.0F, 1.0F, items);
    REQUIRE(items.size() == 1);
    CHECK(items[0].lod == 1);
    view.planes[0] = {0.0F, 0.0F, 0.0F, -100.0F};
    items.clear();
    scene.collect(view, {0.0F, 0.0F, 5.0F}, 400.0F, 1.0F, items);
    CHECK(items.empty());
}

TEST_CASE("scene: what is no wider than the accepted error is left out, but not what gives off light") {
    if (!test::have_context()) {
        return;
    }
    for (const bool glows : {false, true}) {
        SmallScene small;
        for (assets::Material &material : small.file.objects[0].materials) {
            material.emission = glm::vec3(glows ? 1.0F : 0.0F);
        }
        Streamer streamer = small.streamer();
        const Scene scene(small.file, streamer);
        streamer.upload({.bytes = 2200});
        const Instance &instance = scene.objects()[0].instances[0];
        const glm::vec3 eye = glm::vec3(instance.center) + glm::vec3(0.0F, 0.0F, 5.0F * instance.radius_m);
        const float wide_px = 2.0F * 400.0F / 4.0F;
        for (const auto &[kind, error_px, drawn] : {std::tuple(ViewKind::main, 0.99F * wide_px, true),
                                                    {ViewKind::main, 1.01F * wide_px, glows},
                                                    {ViewKind::mirror, 1.01F * wide_px, glows},
                                                    {ViewKind::light, 1.01F * wide_px, true}}) {
            View view;
            view.kind = kind;
            std::vector<DrawItem> items;
            items.reserve(scene.instance_count());
            scene.collect(view, eye, 400.0F, error_px, items);
            CHECK(items.empty() != drawn);
        }
    }
}

TEST_CASE("scene: a scene.json that disagrees with its meshes is rejected") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    const Streamer streamer = small.streamer();
    std::vector<assets::ObjectLod> &lods = small.file.objects[0].lods;
    lods[1].node = "lod2";
    CHECK_THROWS_WITH_AS(Scene(small.file, streamer),
                         "scene.json: object quad: lods[1].node: is lod2, level 1 of its mesh quad_mesh is "
                         "lod1; bake the scene again",
                         Error);
    lods.pop_back();
    CHECK_THROWS_AS(Scene(small.file, streamer), Error);
}

TEST_CASE("scene: an object is dry where no instance, leaning as far as it may, reaches under the water") {
    if (!test::have_context()) {
        return;
    }
    // The quad lies flat at 0, and the wind moves it by 0.775 m. The other one is turned upright: down to -1.
    const auto is_dry = [](std::optional<double> level_m, double second_m) {
        SmallScene small;
        if (level_m) {
            small.file.water.emplace().level_m = *level_m;
        }
        const double half = std::sqrt(0.5);
        small.file.objects[0].instances.push_back(
            {.position = {9.0, second_m, 0.0}, .rotation = {half, half, 0.0, 0.0}});
        const Streamer streamer = small.streamer();
        return Scene(small.file, streamer).objects()[0].dry;
    };
    CHECK(is_dry(std::nullopt, 5.0));
    CHECK(is_dry(-0.8, 5.0));
    CHECK_FALSE(is_dry(-0.7, 5.0));
    CHECK(is_dry(-1.8, 0.0));
    CHECK_FALSE(is_dry(-1.7, 0.0));
    CHECK_FALSE(is_dry(100.0, 5.0));
    const auto moves_dry = [](double level_m) {
        SmallScene small;
        small.file.water.emplace().level_m = static_cast<float>(level_m);
        assets::Motion &motion = small.file.objects[0].motion.emplace();
        motion.radius_m = {2.0, 1.0};
        motion.rise_m = 0.5;
        const Streamer streamer = small.streamer();
        return Scene(small.file, streamer).objects()[0].dry;
    };
    CHECK(moves_dry(-20.0));
    CHECK_FALSE(moves_dry(-5.5)); // its sphere has a radius of 5.275 m, and sinks by 0.5 m
}

TEST_CASE("scene: an instance stands where its placement says, and its sphere holds it in wind and flight") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    assets::Object &object = small.file.objects[0];
    object.center = {0.5, 0.0, 0.25};
    const assets::Placement placement{
        .position = {7.0, 1.0, -2.0}, .rotation = {0.8, 0.0, 0.6, 0.0}, .scale = {1.0, -2.0, 3.0}};
    object.instances = {placement};
    const glm::dvec3 corner(-1.0, 0.0, 1.0);
    const auto placed = [&](const glm::dvec3 &point) {
        return placement.position + placement.rotation * (placement.scale * point);
    };
    {
        const Streamer streamer = small.streamer();
        const Scene scene(small.file, streamer);
        const Instance &instance = scene.objects()[0].instances[0];
        CHECK(glm::distance(glm::dvec3(instance.model * glm::dvec4(corner, 1.0)), placed(corner)) < 1e-12);
        CHECK(glm::distance(instance.center, placed(object.center)) < 1e-12);
        CHECK(instance.mirrored);
        CHECK(instance.scale == 3.0F);
        CHECK(instance.radius_m == doctest::Approx(1.5 * 3.0 + 0.775)); // leaning and fluttering
    }
    object.motion.emplace().beat = {.per_lap = 8, .lift_rad = 0.5, .swing_rad = 0.25};
    object.instances[0].scale.y = 2.0;
    const Streamer streamer = small.streamer();
    const Scene scene(small.file, streamer);
    CHECK(scene.objects()[0].instances[0].radius_m == doctest::Approx(1.5 * 3.0 * 1.75 + 0.775));
    CHECK_FALSE(scene.objects()[0].instances[0].mirrored);
}
