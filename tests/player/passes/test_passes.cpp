// The CPU side of the passes: scrolling waves, particles, and which settings need other programs.

#include "passes/environment_bindings.hpp"
#include "passes/frame.hpp"
#include "passes/particles_pass.hpp"
#include "passes/pass.hpp"

#include <doctest/doctest.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

using namespace paradize;

namespace {

constexpr double flight_s = 240.0;

assets::SceneFile sea() {
    assets::SceneFile file;
    file.flight.duration_s = flight_s;
    file.water.emplace();
    file.water->size_m = 2000.0F;
    file.water->wave_repeat = 400.0F;
    file.water->scroll_per_s = {0.03F, -0.02F};
    return file;
}

assets::ParticleField sparkle() {
    assets::ParticleField field;
    field.center = {1.0F, 2.0F, 3.0F};
    field.radius_m = 4.0F;
    field.count = 64;
    field.size_m = {0.01F, 0.05F};
    field.life_per_s = {0.2F, 0.6F};
    field.threshold = 0.05F;
    return field;
}

/// Distance of two offsets on a circle of circumference 1.
double circular_distance(float a, float b) {
    const double d = std::abs(static_cast<double>(a) - static_cast<double>(b));
    return std::min(d, 1.0 - d);
}

} // namespace

TEST_CASE("waves: the first two layers run against each other over the sea") {
    const assets::SceneFile file = sea();
    const Waves start = waves_at(file, 0.0);
    const Waves later = waves_at(file, 1.0);
    glm::dvec2 drift[2];
    for (std::size_t i = 0; i < 2; ++i) {
        // UV = R xz + offset, so the pattern moves by -R^-1 times the change of the offset.
        const glm::dvec4 rows(start.rows[i]);
        glm::dvec2 change(later.offsets[i] - start.offsets[i]);
        change -= glm::dvec2(std::round(change.x), std::round(change.y));
        const double determinant = rows.x * rows.w - rows.y * rows.z;
        drift[i] = -glm::dvec2(rows.w * change.x - rows.y * change.y, rows.x * change.y - rows.z * change.x) /
                   determinant;
    }
    const double along = drift[0].x * drift[1].x + drift[0].y * drift[1].y;
    const double lengths = std::hypot(drift[0].x, drift[0].y) * std::hypot(drift[1].x, drift[1].y);
    CHECK(lengths > 0.0);
    CHECK(along / lengths < -0.998); // each moves by whole tiles in a flight
}

TEST_CASE("waves: their motion is as smooth after a week as at the start") {
    const assets::SceneFile file = sea();
    constexpr double week_s = 7.0 * 86400.0;
    for (const double start_s : {0.0, week_s}) {
        const double step = circular_distance(waves_at(file, start_s + 1.0 / 60.0).offsets[0].x,
                                              waves_at(file, start_s).offsets[0].x);
        CHECK(step == doctest::Approx(7.0 / 240.0 / 60.0).epsilon(2e-3)); // 7.2 tiles in a flight are asked
    }
}

TEST_CASE("waves: a layer repeats after whole periods") {
    assets::SceneFile file = sea();
    file.water->scroll_per_s = {0.25F, 0.5F}; // exact in binary: periods of 4 s and 2 s
    const Waves start = waves_at(file, 0.0);
    const Waves later = waves_at(file, 4.0 * 1e6);
    CHECK(circular_distance(start.offsets[0].x, later.offsets[0].x) < 1e-6);
    CHECK(circular_distance(start.offsets[0].y, later.offsets[0].y) < 1e-6);
    for (const glm::vec2 &offset : waves_at(file, 12345.678).offsets) {
        CHECK(offset.x >= 0.0F);
        CHECK(offset.x <= 1.0F);
    }
}

TEST_CASE("waves: the floating origin does not move them") {
    const assets::SceneFile file = sea();
    const glm::dvec3 anchor(5.2e6, 0.0, -1e6);
    const Waves whole = waves_at(file, 3.0);
    const Waves part = waves_at(file, 3.0, anchor);
    for (std::size_t i = 0; i < Waves::layers; ++i) {
        const glm::dvec4 rows(whole.rows[i]);
        // The rows are float32 and lose precision so far away; the offsets do not.
        const double u = rows.x * anchor.x + rows.y * anchor.z + static_cast<double>(whole.offsets[i].x);
        const double v = rows.z * anchor.x + rows.w * anchor.z + static_cast<double>(whole.offsets[i].y);
        const double slack = 2e-7 * (std::abs(anchor.x) + std::abs(anchor.z)) * std::abs(rows.x) + 1e-6;
        CHECK(circular_distance(static_cast<float>(u - std::floor(u)), part.offsets[i].x) < slack);
        CHECK(circular_distance(static_cast<float>(v - std::floor(v)), part.offsets[i].y) < slack);
    }
}

TEST_CASE("waves: every layer is at a flight's end where it began, and moves meanwhile") {
    const assets::SceneFile file = sea();
    const Waves start = waves_at(file, 0.0);
    const Waves end = waves_at(file, file.flight.duration_s);
    const Waves meanwhile = waves_at(file, 60.0);
    for (std::size_t i = 0; i < Waves::layers; ++i) {
        CHECK(circular_distance(start.offsets[i].x, end.offsets[i].x) < 1e-6);
        CHECK(circular_distance(start.offsets[i].y, end.offsets[i].y) < 1e-6);
        CHECK(circular_distance(start.offsets[i].x, meanwhile.offsets[i].x) +
                  circular_distance(start.offsets[i].y, meanwhile.offsets[i].y) >
              0.1);
    }
}

TEST_CASE("waves: a layer moves by less than a tile more or less than is asked, and a slow one as is asked") {
    assets::SceneFile file = sea();
    const auto moved = [&](std::size_t layer, double duration_s) { // in a flight
        file.flight.duration_s = duration_s;
        glm::dvec2 second =
            glm::dvec2(waves_at(file, 1.0).offsets[layer] - waves_at(file, 0.0).offsets[layer]);
        second -= glm::round(second);
        return second * duration_s;
    };
    constexpr double long_s = 1e5; // of which a tile more is nothing
    for (const glm::vec2 &scroll :
         {glm::vec2(0.03F, 0.018F), glm::vec2(0.01F, 0.006F), glm::vec2(0.03F, -0.02F)}) {
        file.water->scroll_per_s = scroll;
        for (std::size_t layer = 0; layer < Waves::layers; ++layer) {
            const glm::dvec2 per_s = moved(layer, long_s) / long_s;
            for (const double duration_s : {5.0, 10.0, 40.0, 240.0, 1000.0}) {
                const glm::dvec2 asked = per_s * duration_s;
                const double off = glm::distance(moved(layer, duration_s), asked);
                CHECK(off < (glm::length(asked) < 0.49 ? 0.01 : 1.0));
            }
        }
    }
}

TEST_CASE("waves: no scroll and no tile give finite numbers") {
    assets::SceneFile file = sea();
    *file.water = {};
    file.water->wave_repeat = 0.0F;
    file.water->size_m = 0.0F;
    const Waves waves = waves_at(file, 1e9);
    for (std::size_t i = 0; i < Waves::layers; ++i) {
        CHECK(std::isfinite(waves.rows[i].x));
        CHECK(std::isfinite(waves.offsets[i].x));
        CHECK(std::isfinite(waves.lengths_m[static_cast<int>(i)]));
    }
}

TEST_CASE(
    "particles: life falls at its own rate, and faded particles are respawned elsewhere and differently") {
    const assets::ParticleField field = sparkle();
    ParticleSwarm swarm(field, 1, flight_s);
    std::vector<Particle> before = swarm.particles();
    std::vector<float> fall(before.size(), -1.0F);
    constexpr double step_s = 1.0 / 120.0;
    // the most that whole lives in a flight change the fall of life in a step
    const auto rounded = static_cast<float>(0.5 / flight_s * step_s) * (1.0F - field.threshold);
    int births = 0;
    for (int i = 1; i <= 1200; ++i) {
        swarm.move_to(i * step_s);
        for (std::size_t p = 0; p < before.size(); ++p) {
            const Particle &now = swarm.particles()[p];
            CHECK(now.life >= field.threshold);
            CHECK(now.life <= 1.0F);
            CHECK(now.opacity <= now.life);
            if (now.births == before[p].births) {
                const float fallen = before[p].life - now.life;
                fall[p] = fall[p] < 0.0F ? fallen : fall[p];
                CHECK(fallen == doctest::Approx(fall[p]).epsilon(1e-3)); // as quickly in each life
                CHECK(fallen >= 0.999F * field.life_per_s.x * static_cast<float>(step_s) - rounded);
                CHECK(fallen <= 1.001F * field.life_per_s.y * static_cast<float>(step_s) + rounded);
                CHECK(now.position.y > before[p].position.y);
                continue;
            }
            ++births;
            CHECK(now.births == before[p].births + 1);
            CHECK(before[p].life < field.threshold + 2.0F * field.life_per_s.y * static_cast<float>(step_s));
            CHECK(now.position != before[p].position);
            CHECK(now.size_m != before[p].size_m);
            CHECK(now.rotation_rad != before[p].rotation_rad);
            const glm::vec3 away = now.position;
            CHECK(away.x * away.x + away.y * away.y + away.z * away.z <=
                  1.01F * field.radius_m * field.radius_m);
            CHECK(now.size_m >= field.size_m.x);
            CHECK(now.size_m < field.size_m.y);
        }
        before = swarm.particles();
    }
    CHECK(births > 64);
    CHECK(fall[0] != fall[1]);
}

TEST_CASE("particles: a second's particles are the same however it is reached") {
    ParticleSwarm played(sparkle(), 3, flight_s), skipped(sparkle(), 3, flight_s),
        rewound(sparkle(), 3, flight_s);
    for (int i = 0; i < 2000; ++i) {
        played.move_to(239.0 * i / 2000.0);
    }
    rewound.move_to(1e6);
    for (ParticleSwarm *swarm : {&played, &skipped, &rewound}) {
        swarm->move_to(239.0);
    }
    for (std::size_t p = 0; p < played.particles().size(); ++p) {
        for (const ParticleSwarm *swarm : {&skipped, &rewound}) {
            const Particle &one = played.particles()[p], &other = swarm->particles()[p];
            CHECK(one.position == other.position);
            CHECK(one.opacity == other.opacity);
            CHECK(one.births == other.births);
        }
    }
}

TEST_CASE("particles: at a flight's end they are as they were at its beginning") {
    ParticleSwarm first(sparkle(), 3, flight_s), last(sparkle(), 3, flight_s),
        meanwhile(sparkle(), 3, flight_s);
    last.move_to(flight_s);
    meanwhile.move_to(0.5 * flight_s);
    for (std::size_t p = 0; p < first.particles().size(); ++p) {
        const Particle &one = first.particles()[p], &other = last.particles()[p];
        CHECK(other.births == one.births);
        CHECK(glm::distance(one.position, other.position) < 1e-6F);
        CHECK(other.opacity == doctest::Approx(one.opacity).epsilon(1e-5));
        CHECK(meanwhile.particles()[p].position != one.position);
    }
}

TEST_CASE("particles: the same seed gives the same swarm, another seed another one") {
    ParticleSwarm one(sparkle(), 7, flight_s), same(sparkle(), 7, flight_s), other(sparkle(), 8, flight_s);
    for (ParticleSwarm *swarm : {&one, &same, &other}) {
        swarm->move_to(5.0);
    }
    CHECK(one.particles()[5].position == same.particles()[5].position);
    CHECK(one.particles()[5].position != other.particles()[5].position);
}

TEST_CASE("particles: an empty field, one whose life does not fall, and one that is dead at birth") {
    assets::ParticleField field = sparkle();
    field.count = 0;
    ParticleSwarm none(field, 1, flight_s);
    none.move_to(1.0);
    CHECK(none.particles().empty());
    field.count = 3;
    field.life_per_s = {0.0F, 0.0F};
    ParticleSwarm still(field, 1, flight_s);
    still.move_to(1e6);
    CHECK(still.particles()[0].births == 1);
    field.life_per_s = {0.5F, 0.5F};
    field.threshold = 1.0F;
    ParticleSwarm dead(field, 1, flight_s);
    dead.move_to(1e6);
    CHECK(std::isfinite(dead.particles()[0].position.y));
    CHECK(dead.particles()[0].opacity == 0.0F);
}

TEST_CASE("passes: objects are made anew for settings that their programs depend on") {
    const auto found = std::ranges::find(pass_names(), "objects");
    REQUIRE(found != pass_names().end());
    const auto objects = static_cast<std::size_t>(found - pass_names().begin());
    const RenderSettings made_for;
    CHECK(reusable(objects, made_for, made_for));
    RenderSettings wanted = made_for;
    wanted.lod_error_px *= 3.0F;
    CHECK(reusable(objects, made_for, wanted));
    wanted = made_for;
    wanted.vertex_lighting = false;
    CHECK_FALSE(reusable(objects, made_for, wanted));
    wanted = made_for;
    wanted.samples = 0;
    CHECK_FALSE(reusable(objects, made_for, wanted));
    wanted = made_for;
    wanted.fine_edges = false;
    CHECK_FALSE(reusable(objects, made_for, wanted));
}

TEST_CASE("passes: those that see the light, the waves or the mirror are made anew where these change") {
    const auto changes = [](std::string_view pass, const auto &change) {
        const auto index =
            static_cast<std::size_t>(std::ranges::find(pass_names(), pass) - pass_names().begin());
        const RenderSettings made_for;
        RenderSettings wanted = made_for;
        change(wanted);
        return !reusable(index, made_for, wanted);
    };
    for (const std::string_view pass : {"terrain", "objects", "blended"}) {
        CHECK(changes(pass, [](RenderSettings &s) { s.anisotropy = 16.0F; }));
        CHECK(changes(pass, [](RenderSettings &s) { s.sky_light = false; }));
    }
    CHECK(changes("water", [](RenderSettings &s) { s.near_waves = !s.near_waves; }));
    CHECK(changes("water", [](RenderSettings &s) { s.shadow_filter = ShadowFilter::penumbra; }));
    CHECK(changes("reflection", [](RenderSettings &s) { s.samples = 0; }));
    CHECK(changes("reflection", [](RenderSettings &s) { s.reflection_scale = 0.5F; }));
    CHECK(changes("refraction", [](RenderSettings &s) { s.refraction_scale = 0.5F; }));
    CHECK(changes("shadow", [](RenderSettings &s) { s.shadow_size_px /= 2; }));
    CHECK(changes("shafts", [](RenderSettings &s) { s.shaft_steps = 32; }));
}

TEST_CASE("random numbers are uniform in [0, 1)") {
    Pcg random(54);
    double sum = 0.0;
    for (int i = 0; i < 100000; ++i) {
        const float value = random.uniform(0.0F, 1.0F);
        CHECK_UNARY(value >= 0.0F && value < 1.0F);
        sum += static_cast<double>(value);
    }
    CHECK(sum / 100000.0 == doctest::Approx(0.5).epsilon(0.01));
}
