#include "context.hpp"
#include "error.hpp"
#include "small_scene.hpp"
#include "streaming/scene.hpp"
#include "streaming/streamer.hpp"

#include <doctest/doctest.h>

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

TEST_CASE("scene: a scene.json that disagrees with its meshes is rejected") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    small.file.objects[0].lods.pop_back();
    const Streamer streamer = small.streamer();
    CHECK_THROWS_AS(Scene(small.file, streamer), Error);
}
