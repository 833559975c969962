#include "context.hpp"
#include "sea_probe.hpp"

#include <doctest/doctest.h>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <cmath>

using namespace paradize;
using test::SeaProbe;

namespace {

/// A place so near that haze between it and the eye, 1 mm above the water, cannot be seen.
glm::vec2 seen_at(double elevation_rad, double eye_m = 0.001) {
    return {static_cast<float>(eye_m / std::tan(elevation_rad)), 0.0F};
}

double radians(double degrees) {
    return degrees * M_PI / 180.0;
}

void hazy_evening(gl::FrameUniforms &frame) {
    frame.fog = {0.2F, 0.3F, 2.0F, 0.02F};
    frame.sun_direction = glm::vec4(glm::normalize(glm::vec3(1.0F, 0.2F, 0.0F)), 0.005F);
    frame.daylight.y = 1.0F; // haze is brighter towards the sun
}

/// The share of the sea's own light that is left: what is left of its colour in black haze.
double left_in_haze(SeaProbe &sea, const glm::vec2 &xz, float haze_per_m) {
    sea.frame.fog = glm::vec4(0.0F);
    const double clear = sea.at(xz).g;
    sea.frame.fog.w = haze_per_m;
    return sea.at(xz).g / clear;
}

} // namespace

TEST_CASE("sea: it mirrors as much of the sky as Fresnel's equations say") {
    if (!test::have_context()) {
        return;
    }
    SeaProbe sea;
    sea.frame.eye.y = 0.001F;
    for (const double degrees : {3.0, 8.0, 15.0, 25.0, 40.0, 60.0, 85.0}) {
        const double elevation = radians(degrees);
        const double reflected = sea.at(seen_at(elevation)).g;
        const double slack = degrees < 20.0 ? 0.07 : 0.01; // of Schlick's approximation
        CHECK(std::abs(reflected - test::fresnel_of_water(std::sin(elevation))) < slack);
        sea.sky_blur = -1.0F; // no sky: the haze is all around
        sea.frame.fog = {0.0F, 0.5F, 0.0F, 0.0F};
        CHECK(sea.at(seen_at(elevation)).g == test::within(0.5 * reflected, 1e-3));
        sea.sky_blur = 1.0F;
    }
}

TEST_CASE("sea: the sky that it mirrors is as hazy as the sky above it") {
    if (!test::have_context()) {
        return;
    }
    SeaProbe sea;
    sea.frame.eye.y = 0.001F;
    for (const double degrees : {5.0, 10.0, 20.0, 45.0}) {
        const double elevation = radians(degrees);
        sea.frame.fog = glm::vec4(0.0F);
        const glm::dvec4 clear = sea.at(seen_at(elevation));
        hazy_evening(sea.frame);
        const glm::dvec4 hazy = sea.at(seen_at(elevation));
        const glm::vec3 mirrored(std::cos(elevation), std::sin(elevation), 0.0F);
        const glm::dvec3 sky = sea.drawn_sky(mirrored); // of a clear sky of 1
        for (int i = 0; i < 3; ++i) {
            CHECK(hazy[i] / clear[i] == test::within(sky[i], 0.01));
        }
        CHECK(std::abs(sky.b - 1.0) > 0.02);
    }
}

TEST_CASE("sea: from below, the hazy sky fills Snell's window, and beyond it is only water") {
    if (!test::have_context()) {
        return;
    }
    SeaProbe sea({"IN_WATER 1"});
    sea.frame.eye.y = -1.0F;
    hazy_evening(sea.frame);
    for (const double degrees : {1.0, 20.0, 40.0, 46.0, 48.5}) {
        const double below = radians(degrees), above = std::asin(test::water_index * std::sin(below));
        const glm::dvec4 seen = sea.at({std::tan(below), 0.0F});
        const glm::dvec3 sky = sea.drawn_sky(glm::vec3(std::sin(above), std::cos(above), 0.0F));
        const double passes = 1.0 - test::fresnel_of_water(std::cos(above));
        for (int i = 0; i < 3; ++i) {
            const double slack = degrees < 45.0 ? 0.02 : 0.08; // of Schlick's approximation
            CHECK(std::abs(seen[i] - passes * sky[i]) < slack * sky[i]);
        }
    }
    sea.water_glow = {0.1F, 0.2F, 0.3F};
    for (const double degrees : {48.9, 60.0, 85.0}) {
        const glm::dvec4 seen = sea.at({std::tan(radians(degrees)), 0.0F});
        CHECK(glm::length(glm::dvec3(seen) - glm::dvec3(sea.water_glow)) < 1e-4);
    }
}

TEST_CASE("sea: water between the eye and Snell's window takes its light colour by colour") {
    if (!test::have_context()) {
        return;
    }
    SeaProbe sea({"IN_WATER 1"});
    sea.frame.eye.y = -3.0F;
    const glm::dvec4 clear = sea.at({0.0F, 0.0F});
    sea.frame.water = {0.4F, 0.1F, 0.05F, 0.0F};
    sea.scatter_per_m = 0.2F;
    const glm::dvec4 seen = sea.at({0.0F, 0.0F});
    for (int i = 0; i < 3; ++i) {
        const double per_m = static_cast<double>(sea.frame.water[i]) + 0.2;
        CHECK(seen[i] / clear[i] == test::within(std::exp(-3.0 * per_m), 1e-3));
    }
}

TEST_CASE("sea: the floor's light is absorbed along the refracted ray, and the water's own takes its place") {
    if (!test::have_context()) {
        return;
    }
    SeaProbe sea;
    sea.sky = SeaProbe::one_sky(glm::vec3(0.0F));
    sea.has_refraction = true;
    constexpr double depth_m = 2.0;
    sea.frame.water = {0.4F, 0.2F, 0.05F, 0.0F};
    sea.scatter_per_m = 0.1F;
    for (const double degrees : {1.0, 45.0, 70.0}) { // from the vertical
        sea.refraction = test::one_color(1.0F, 1.0F, 1.0F, 1.0F / (1.0F + depth_m));
        const glm::vec2 place(std::tan(radians(degrees)), 0.0F);
        sea.deep = sea.shallow = glm::vec3(0.0F);
        sea.frame.ambient = glm::vec4(1.0F);
        const glm::dvec4 floor = sea.at(place);
        sea.refraction = test::one_color(0.0F, 0.0F, 0.0F, 1.0F / (1.0F + depth_m));
        sea.deep = sea.shallow = glm::vec3(1.0F);
        const glm::dvec4 own = sea.at(place);
        const double below = std::asin(std::sin(radians(degrees)) / test::water_index);
        const double enters = 1.0 - test::fresnel_of_water(std::cos(radians(degrees)));
        for (int i = 0; i < 3; ++i) {
            const double per_m = static_cast<double>(sea.frame.water[i]) + 0.1;
            const double left = std::exp(-per_m * depth_m / std::cos(below));
            CHECK(floor[i] == test::within(enters * left, 0.02));
            CHECK(floor[i] + own[i] == test::within(enters, 0.02)); // one is what the other is not
        }
    }
}

TEST_CASE("sea: it ends in haze before its border, and not before half of the way") {
    if (!test::have_context()) {
        return;
    }
    SeaProbe sea;
    sea.frame.eye.y = 60.0F;
    sea.frame.fog = {0.3F, 0.4F, 0.5F, 1e-6F};
    sea.fade_distance_m = 1000.0F;
    const auto haze_at = [&](double distance_m) { // the share of haze
        const glm::vec2 place(std::sqrt(distance_m * distance_m - 3600.0), 0.0F);
        sea.fade_distance_m = 1e9F;
        const double clear = sea.at(place).g;
        sea.fade_distance_m = 1000.0F;
        return (sea.at(place).g - clear) / (0.4 - clear);
    };
    double before = haze_at(500.0);
    CHECK(std::abs(before) < 0.01);
    for (double distance_m = 575.0; distance_m < 950.0; distance_m += 25.0) {
        const double now = haze_at(distance_m);
        CHECK(now > before);
        CHECK(now - before < 0.12); // no edge is seen
        before = now;
    }
    CHECK(before < 0.99);
    CHECK(haze_at(955.0) == test::within(1.0, 1e-3));
    CHECK(haze_at(3000.0) == test::within(1.0, 1e-3));
}

TEST_CASE("sea: for an eye close to the water the horizon is haze, but not the water before it") {
    if (!test::have_context()) {
        return;
    }
    SeaProbe sea;
    sea.frame.fog = {0.3F, 0.4F, 0.5F, 0.0F};
    sea.sky = SeaProbe::one_sky(glm::vec3(0.0F)); // a black sea in bright haze
    const auto haze_at = [&](float eye_m, float distance_m) {
        sea.frame.eye.y = eye_m;
        return sea.at({distance_m, 0.0F}).g / 0.4;
    };
    CHECK(haze_at(0.01F, 200.0F) > 0.98);
    CHECK(haze_at(0.01F, 29.0F) < 1e-3);
    CHECK(haze_at(20.0F, 200.0F) < 1e-3);
    double before = haze_at(0.2F, 30.0F);
    for (float distance_m = 40.0F; distance_m < 400.0F; distance_m *= 1.2F) {
        const double now = haze_at(0.2F, distance_m);
        CHECK(now > before);
        before = now;
    }
}

TEST_CASE("sea: spray adds to the haze over it with the square of the distance") {
    if (!test::have_context()) {
        return;
    }
    SeaProbe sea;
    sea.frame.eye.y = 20.0F;
    sea.has_reflection = true;
    sea.reflection = test::one_color(1.0F, 1.0F, 1.0F, 1.0F);
    constexpr double per_m = 0.004;
    const auto spray = [&](float away_m) { // its optical depth over that of the air
        const double distance_m = std::hypot(20.0, away_m);
        const double left = left_in_haze(sea, {away_m, 0.0F}, static_cast<float>(per_m));
        return -std::log(left) / (0.95 * per_m * distance_m) - 1.0;
    };
    const double hundred = spray(100.0F), two_hundred = spray(200.0F), four_hundred = spray(400.0F);
    CHECK(two_hundred / hundred == test::within(std::hypot(20.0, 200.0) / std::hypot(20.0, 100.0), 0.02));
    CHECK(four_hundred / hundred == test::within(std::hypot(20.0, 400.0) / std::hypot(20.0, 100.0), 0.02));
    const double at_one = hundred / (per_m * std::hypot(20.0, 100.0)); // where the air alone leaves 1 / e
    CHECK(at_one > 1.4);
    CHECK(at_one < 2.2);
}

TEST_CASE("sea: at the horizon it has the colour of the sky there, brighter towards the sun") {
    if (!test::have_context()) {
        return;
    }
    SeaProbe sea;
    hazy_evening(sea.frame);
    sea.frame.eye.y = 20.0F;
    for (const glm::vec2 &far :
         {glm::vec2(2000.0F, 0.0F), glm::vec2(-2000.0F, 0.0F), glm::vec2(0.0F, 2000.0F)}) {
        const glm::dvec3 seen = sea.at(far), sky = sea.drawn_sky(glm::vec3(far.x, 0.0F, far.y));
        CHECK(glm::length(seen - sky) < 0.01);
    }
    CHECK(sea.at({2000.0F, 0.0F}).b > 1.2 * sea.at({-2000.0F, 0.0F}).b);
}

TEST_CASE(
    "sea: slopes that face the eye mirror by their own angle, those that face away more, and never all") {
    if (!test::have_context()) {
        return;
    }
    SeaProbe sea;
    const glm::vec2 place(4.0F, 0.0F); // 14 degrees below the eye
    const double calm = sea.at(place).g;
    double before = calm;
    for (const float lean : {0.01F, 0.02F, 0.04F}) { // each of three layers, the third 1.4 times
        sea.lean = {-lean, 0.0F};
        const double towards = sea.at(place).g;
        const double tilt = std::asin(3.4 * static_cast<double>(lean)) + std::atan2(1.0, 4.0);
        CHECK(towards == test::within(test::fresnel_of_water(std::sin(tilt)), 0.2));
        CHECK(towards < before);
        before = towards;
        sea.lean = {lean, 0.0F};
        CHECK(sea.at(place).g > calm);
        CHECK(sea.at(place).g < 0.95);
    }
    sea.lean = {0.2F, 0.0F}; // its back is hidden by the next wave
    CHECK(sea.at(place).g < 0.95);
}
