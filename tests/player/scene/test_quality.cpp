// Render settings of each quality, and the samples of the reference.

#include "assets/tradeoff_file.hpp"
#include "error.hpp"
#include "render/samples.hpp"
#include "scene/quality.hpp"

#include <doctest/doctest.h>

#include <glm/geometric.hpp>

#include <cmath>

using namespace paradize;

namespace {

assets::SceneFile island() {
    assets::SceneFile file;
    file.shadow = assets::Shadow();
    file.light_shafts = assets::LightShafts();
    file.water = assets::Water();
    file.reflection_scale = 0.5F;
    file.refraction_scale = 0.25F;
    file.terrain = assets::Terrain();
    file.lod_error_px = 2.0F;
    return file;
}

Quality only(QualityFeature feature, Tier tier) {
    Quality out = all_at(Tier::balanced);
    out[static_cast<std::size_t>(feature)] = tier;
    return out;
}

} // namespace

TEST_CASE("quality: balanced gives the scene's own settings") {
    const RenderSettings settings = render_settings(island(), all_at(Tier::balanced), Device());
    RenderSettings asked;
    asked.shadow_size_px = 2048;
    asked.reflection_scale = 0.5F;
    asked.refraction_scale = 0.25F;
    asked.anisotropy = 4.0F;
    asked.lod_error_px = 2.0F;
    CHECK(settings == asked);
}

TEST_CASE("quality: each feature changes its own setting only") {
    const assets::SceneFile file = island();
    const RenderSettings balanced = render_settings(file, all_at(Tier::balanced), Device());
    for (std::size_t i = 0; i < feature_count; ++i) {
        for (const Tier tier : {Tier::fast, Tier::exact}) {
            const auto feature = static_cast<QualityFeature>(i);
            RenderSettings settings = render_settings(file, only(feature, tier), Device());
            CHECK((settings != balanced || (feature == QualityFeature::resolution && tier == Tier::exact)));
            switch (feature) {
            case QualityFeature::shadow:
                settings.shadow_size_px = balanced.shadow_size_px;
                settings.shadow_filter = balanced.shadow_filter;
                settings.shadow_cascades = balanced.shadow_cascades;
                CHECK((settings.shaft_steps == 0) == (tier == Tier::fast));
                CHECK(settings.sky_light == (tier != Tier::fast));
                CHECK(settings.shadow_steps_per_s == (tier == Tier::fast ? 5.0 : 10.0));
                settings.shadow_steps_per_s = balanced.shadow_steps_per_s;
                settings.sky_light = balanced.sky_light;
                settings.shaft_steps = balanced.shaft_steps;
                break;
            case QualityFeature::reflection:
                settings.reflection_scale = balanced.reflection_scale;
                break;
            case QualityFeature::refraction:
                settings.refraction_scale = balanced.refraction_scale;
                break;
            case QualityFeature::parallax:
                settings.parallax_steps = balanced.parallax_steps;
                break;
            case QualityFeature::anisotropy:
                settings.anisotropy = balanced.anisotropy;
                break;
            case QualityFeature::lod:
                settings.lod_error_px = balanced.lod_error_px;
                CHECK(settings.fine_edges == (tier != Tier::fast));
                CHECK(settings.vertex_lighting == (tier != Tier::exact));
                settings.vertex_lighting = balanced.vertex_lighting;
                settings.fine_edges = balanced.fine_edges;
                break;
            case QualityFeature::resolution:
                CHECK((settings.render_scale < 1.0F) == (tier == Tier::fast));
                CHECK((settings.samples == 0) == (tier == Tier::fast));
                settings.render_scale = balanced.render_scale;
                settings.samples = balanced.samples;
                break;
            }
            CHECK(settings == balanced);
        }
    }
}

TEST_CASE("quality: device limits hold, and a scene need not have every feature") {
    Device small{true, 2048};
    CHECK(render_settings(island(), all_at(Tier::exact), small).shadow_size_px == 2048);
    for (const Tier tier : {Tier::fast, Tier::exact}) {
        CHECK(render_settings(island(), all_at(tier), small).anisotropy == 1.0F);
    }
    CHECK_FALSE(has_feature(island(), QualityFeature::anisotropy, small));
    CHECK(has_feature(island(), QualityFeature::anisotropy, Device()));
    CHECK(has_feature(island(), QualityFeature::shadow, small));
    CHECK_FALSE(has_feature(island(), QualityFeature::parallax, small)); // no object has parallax
    CHECK_FALSE(has_feature(assets::SceneFile(), QualityFeature::shadow, small));
    CHECK_FALSE(has_feature(assets::SceneFile(), QualityFeature::lod, small));
    CHECK(render_settings(island(), all_at(Tier::balanced), small).late_depth_test);
    CHECK_FALSE(render_settings(island(), all_at(Tier::balanced), Device()).late_depth_test);
    CHECK(has_feature(assets::SceneFile(), QualityFeature::resolution, small));
}

TEST_CASE("reference: samples lie in the pixel and on the sun's disc, with the centre as their mean") {
    for (const int count : {1, 4, 16, 64, 100}) {
        glm::dvec2 pixel(0.0);
        glm::dvec2 sun(0.0);
        for (const Sample &sample : reference_samples(count)) {
            CHECK(std::max(std::abs(sample.pixel.x), std::abs(sample.pixel.y)) < 0.6F);
            CHECK(glm::length(sample.sun) < 1.2F);
            pixel += glm::dvec2(sample.pixel);
            sun += glm::dvec2(sample.sun);
        }
        CHECK(glm::length(pixel) < 1e-4);
        CHECK(glm::length(sun) < 1e-4);
    }
    CHECK(reference_samples(1)[0].pixel == glm::vec2(0.0F));
}

TEST_CASE("reference: directions to the sun's disc span its angular size") {
    for (const glm::vec3 to_sun :
         {glm::vec3(0.0F, 1.0F, 0.0F), glm::normalize(glm::vec3(0.3F, 0.4F, -0.5F))}) {
        for (const glm::vec2 place : {glm::vec2(1.0F, 0.0F), glm::vec2(0.0F, -1.0F)}) {
            const glm::vec3 moved = sun_direction(to_sun, 0.01F, place);
            CHECK(glm::length(moved) == doctest::Approx(1.0));
            CHECK(std::acos(glm::dot(glm::dvec3(moved), glm::dvec3(to_sun))) ==
                  doctest::Approx(0.01).epsilon(0.02));
        }
        CHECK(glm::distance(sun_direction(to_sun, 0.01F, glm::vec2(0.0F)), to_sun) < 1e-6F);
    }
}

TEST_CASE("tradeoff file: groups of frame time are read, others are skipped, invalid files rejected") {
    const auto read = assets::parse_tradeoff(
        R"({"groups": [{"time": "stage", "name": "mesh"}, {"time": "frame", "name": "shadow", "points":
            [{"tier": "fast", "error": {"mean": 0.25, "max": 1}}]}]})",
        "t.json");
    REQUIRE(read.size() == 1);
    CHECK(read[0].feature == "shadow");
    CHECK(read[0].tier == "fast");
    CHECK(read[0].flip == 0.25);
    CHECK_THROWS_AS(assets::parse_tradeoff("{}", "t.json"), Error);
    CHECK_THROWS_AS(
        assets::parse_tradeoff(R"({"groups": [{"time": "frame", "name": "a", "points": [{"tier": "fast",
        "error": {"mean": 7}}]}]})",
                               "t.json"),
        Error);
}
