#include "scene/wind.hpp"

#include <doctest/doctest.h>
#include <glm/gtc/constants.hpp>
#include <glm/vec2.hpp>

#include <cmath>

using namespace paradize;

namespace {

const assets::Wind breeze{{0.6F, -0.8F}, 5.0F, 20.0F};
constexpr double round_s = 240.0; // of the flight

double apart(float a, float b) {
    return std::abs(std::remainder(static_cast<double>(a) - static_cast<double>(b), glm::two_pi<double>()));
}

/// The phases of the four waves at a place, as shaders/lib/wind.glsl finds them from those at the anchor.
glm::vec4 at(const WindNow &wind, const glm::vec3 &place) {
    const float along = wind.direction.z * (wind.direction.x * place.x + wind.direction.y * place.z);
    const float across = wind.direction.z * (wind.direction.x * place.z - wind.direction.y * place.x);
    return {along + wind.phases.x, 1.7F * along + 0.9F * across + wind.phases.y, 3.0F * along + wind.phases.z,
            2.1F * place.x + 1.3F * place.y + 2.9F * place.z + wind.phases.w};
}

} // namespace

TEST_CASE("wind: a place has the same phases from every anchor") {
    const glm::dvec3 anchor(1024.0, -512.0, 4096.0);
    const glm::vec3 near(3.0F, 1.0F, -2.0F);
    const glm::vec4 one = at(wind_now(breeze, round_s, 12.5, anchor), near);
    const glm::vec4 other = at(wind_now(breeze, round_s, 12.5, anchor - glm::dvec3(64.0, 8.0, -32.0)),
                               near + glm::vec3(64.0F, 8.0F, -32.0F));
    for (int k = 0; k < 4; ++k) {
        CHECK(apart(one[k], other[k]) < 1e-3);
    }
}

TEST_CASE("wind: it is as smooth after a month as at the start, and phases are wrapped") {
    for (const double start_s : {0.0, 2.6e6}) {
        const WindNow now = wind_now(breeze, round_s, start_s, glm::dvec3(0.0));
        const WindNow soon = wind_now(breeze, round_s, start_s + 0.01, glm::dvec3(0.0));
        const WindNow first = wind_now(breeze, round_s, 0.0, glm::dvec3(0.0));
        const WindNow then = wind_now(breeze, round_s, 0.01, glm::dvec3(0.0));
        for (int k = 0; k < 4; ++k) {
            CHECK(now.phases[k] >= 0.0F);
            CHECK(now.phases[k] <= glm::two_pi<float>());
            CHECK(apart(now.phases[k], soon.phases[k]) ==
                  doctest::Approx(apart(first.phases[k], then.phases[k])).epsilon(1e-3));
        }
    }
}

TEST_CASE("wind: a gust of 20 m at 5 m/s is back after four seconds") {
    const WindNow now = wind_now(breeze, round_s, 1.0, glm::dvec3(0.0));
    CHECK(apart(now.phases.x, wind_now(breeze, round_s, 5.0, glm::dvec3(0.0)).phases.x) < 1e-5);
    CHECK(apart(now.phases.x, wind_now(breeze, round_s, 3.0, glm::dvec3(0.0)).phases.x) > 3.0);
    // It travels where the wind blows: the same phase lies 5 m on after a second.
    const glm::vec4 before = at(now, glm::vec3(0.0F));
    const glm::vec4 after = at(wind_now(breeze, round_s, 2.0, glm::dvec3(0.0)), glm::vec3(3.0F, 0.0F, -4.0F));
    CHECK(apart(before.x, after.x) < 1e-4);
}

TEST_CASE("wind: at a flight's end it is as it began, and it blows meanwhile") {
    constexpr double odd_s = 123.4; // in which no wave turns a whole number of times by itself
    const WindNow first = wind_now(breeze, odd_s, 0.0, glm::dvec3(0.0));
    const WindNow last = wind_now(breeze, odd_s, odd_s, glm::dvec3(0.0));
    const WindNow meanwhile = wind_now(breeze, odd_s, 0.1, glm::dvec3(0.0));
    for (int k = 0; k < 4; ++k) {
        CHECK(apart(first.phases[k], last.phases[k]) < 1e-6);
        CHECK(apart(first.phases[k], meanwhile.phases[k]) > 0.01);
    }
}
