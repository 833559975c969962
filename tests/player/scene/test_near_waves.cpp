#include "scene/near_waves.hpp"

#include <doctest/doctest.h>
#include <glm/geometric.hpp>

#include <cmath>

using namespace paradize;

namespace {

assets::SceneFile wavy_scene() {
    assets::SceneFile file;
    file.flight.duration_s = 240.0;
    file.water.emplace();
    file.water->wave_height_m = 0.4F;
    file.water->wave_length_m = 9.0F;
    return file;
}

View eye_at(double height_m, const glm::dvec3 &anchor = glm::dvec3(0.0)) {
    View view;
    view.anchor = anchor;
    view.eye = glm::vec3(glm::dvec3(3.0, height_m, 5.0) - anchor);
    return view;
}

float height_of(const NearWaves &waves) {
    float sum = 0.0F;
    for (const glm::vec4 &wave : waves) {
        sum += 2.0F * wave.w;
    }
    return sum;
}

} // namespace

TEST_CASE("near waves: together they are as high as the scene says, and none folds over") {
    const NearWaves waves = near_waves_at(wavy_scene(), 12.3, eye_at(2.0));
    CHECK(height_of(waves) == doctest::Approx(0.4));
    float steepness = 0.0F;
    for (const glm::vec4 &wave : waves) {
        steepness += wave.w * glm::length(glm::vec2(wave));
    }
    CHECK(steepness * (9.0F * 0.15F / 0.4F) < 1.0F); // at the largest height that a scene may ask for
}

TEST_CASE("near waves: they repeat with the flight") {
    const NearWaves first = near_waves_at(wavy_scene(), 12.5, eye_at(2.0));
    const NearWaves later = near_waves_at(wavy_scene(), 12.5 + 240.0, eye_at(2.0));
    for (std::size_t i = 0; i < first.size(); ++i) {
        CHECK(first[i] == later[i]);
    }
    const NearWaves end = near_waves_at(wavy_scene(), 240.0 - 1e-6, eye_at(2.0));
    const NearWaves begin = near_waves_at(wavy_scene(), 0.0, eye_at(2.0));
    for (std::size_t i = 0; i < end.size(); ++i) {
        CHECK(std::abs(std::sin(end[i].z) - std::sin(begin[i].z)) < 1e-4F);
        CHECK(std::abs(std::cos(end[i].z) - std::cos(begin[i].z)) < 1e-4F);
    }
}

TEST_CASE("near waves: the longest runs against the scroll of the normal map, as its layer 0 does") {
    assets::SceneFile file = wavy_scene();
    for (const glm::vec2 scroll : {glm::vec2(0.02F, 0.0F), glm::vec2(-0.01F, 0.03F)}) {
        file.water->scroll_per_s = scroll;
        const glm::vec2 way(near_waves_at(file, 0.0, eye_at(2.0))[0]);
        CHECK(glm::dot(glm::normalize(way), glm::normalize(scroll)) < -0.9F);
    }
}

TEST_CASE("near waves: none reaches an eye that is low over the water") {
    for (const double eye_m : {0.3, 0.1, 0.0}) {
        CHECK(height_of(near_waves_at(wavy_scene(), 1.0, eye_at(eye_m))) <= eye_m + 1e-6);
    }
}

TEST_CASE("near waves: the floating origin moves neither waves nor grid") {
    const glm::dvec3 anchor(1000.25, 0.0, -70.5);
    const NearWaves near = near_waves_at(wavy_scene(), 1.0, eye_at(2.0));
    const NearWaves far = near_waves_at(wavy_scene(), 1.0, eye_at(2.0, anchor));
    const glm::dvec2 place(4.0, 6.0);
    for (std::size_t i = 0; i < near.size(); ++i) {
        const auto angle = [&](const glm::vec4 &wave, const glm::dvec2 &at) {
            return glm::dot(glm::dvec2(wave), at) + static_cast<double>(wave.z);
        };
        const double here = angle(near[i], place);
        const double there = angle(far[i], place - glm::dvec2(anchor.x, anchor.z));
        CHECK(std::sin(here) == doctest::Approx(std::sin(there)).epsilon(0.001));
    }
    const assets::Water water = *wavy_scene().water;
    const glm::dvec2 moved =
        glm::dvec2(grid_center(water, eye_at(2.0, anchor))) + glm::dvec2(anchor.x, anchor.z);
    CHECK(glm::distance(glm::dvec2(grid_center(water, eye_at(2.0))), moved) < 1e-3);
}

TEST_CASE("near waves: they end before the shore") {
    assets::SceneFile file = wavy_scene();
    CHECK(wave_shares(file).shares == std::vector<float>{1.0F}); // without a terrain
    file.terrain.emplace();
    file.terrain->size_m = {40.0F, 10.0F};
    file.terrain->floor = {4, 1, {10.0F, 10.0F}, {2.0F, -0.5F, -2.0F, -9.0F}};
    const WaveShares shares = wave_shares(file);
    CHECK(shares.columns == 4);
    CHECK(shares.shares[0] == 0.0F);
    CHECK(shares.shares[1] == 0.0F);
    CHECK(shares.shares[2] > 0.2F);
    CHECK(shares.shares[2] < 0.8F);
    CHECK(shares.shares[3] == 1.0F);
}
