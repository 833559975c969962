#include "assets/scene/file.hpp"
#include "scene/bake_limits.hpp"

#include <doctest/doctest.h>

using namespace paradize;

namespace {

assets::SceneFile scene_with(int left_out) {
    assets::SceneFile scene;
    scene.largest_width_px = 320;
    scene.largest_height_px = 180;
    assets::Artifact artifact;
    artifact.trimmed_levels = left_out;
    scene.artifacts.push_back(artifact);
    return scene;
}

} // namespace

TEST_CASE("bake limits: a picture above the largest gives one warning, whichever side is longer") {
    const assets::SceneFile scene = scene_with(1);
    for (const auto &[width, height] : {std::pair(321, 180), std::pair(320, 181)}) {
        BakeLimits baked(scene);
        CHECK(baked.check_size(320, 180).empty());
        const std::string text = baked.check_size(width, height);
        CHECK(text.find(std::to_string(width) + " x " + std::to_string(height)) != std::string::npos);
        CHECK(text.find("baked for at most 320 x 180") != std::string::npos);
        CHECK(text.find('\n') == std::string::npos);
        CHECK(baked.check_size(4000, 4000).empty());
        CHECK(baked.messages() == std::vector<std::string>{text});
    }
}

TEST_CASE("bake limits: a camera that leaves its region gives one warning, and none before") {
    assets::SceneFile scene = scene_with(2);
    scene.free_camera = assets::FreeCameraBox{{-1.0, 0.0, -2.0}, {1.0, 3.0, 2.0}, 0.5F};
    BakeLimits baked(scene);
    CHECK(baked.check_camera({-1.0, 0.0, 2.0}).empty());
    CHECK(baked.check_camera({0.0, 3.1, 0.0}).find("has left the region") != std::string::npos);
    CHECK(baked.check_camera({9.0, 9.0, 9.0}).empty());
    CHECK(baked.messages().size() == 1);
}

TEST_CASE("bake limits: a free camera in a scene without a region gives one warning") {
    const assets::SceneFile scene = scene_with(1);
    BakeLimits baked(scene);
    CHECK(baked.check_camera({0.0, 0.0, 0.0}).find("declares no [free_camera]") != std::string::npos);
    CHECK(baked.check_camera({0.0, 0.0, 0.0}).empty());
}

TEST_CASE("bake limits: a bake that left nothing out gives no warning") {
    assets::SceneFile scene = scene_with(0);
    BakeLimits baked(scene);
    CHECK(baked.check_size(4000, 4000).empty());
    CHECK(baked.check_camera({0.0, 0.0, 0.0}).empty());
    scene.terrain.emplace().trimmed_patches = 1;
    CHECK_FALSE(BakeLimits(scene).check_size(4000, 4000).empty());
}
