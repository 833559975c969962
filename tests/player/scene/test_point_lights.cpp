#include "scene/point_lights.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

using namespace paradize;

namespace {

constexpr double flight_s = 240.0;

assets::PointLight lamp_on(double on_s, double off_s, float fade_s) {
    assets::PointLight out;
    out.always = false;
    out.on_s = on_s;
    out.off_s = off_s;
    out.fade_s = fade_s;
    return out;
}

float strength(const assets::PointLight &light, double second, std::size_t number = 0) {
    return light_strength(light, number, {std::fmod(second, flight_s), second}, flight_s);
}

} // namespace

TEST_CASE("point lights: one goes on and off at its seconds, each with its ramp") {
    const assets::PointLight light = lamp_on(170.0, 230.0, 2.0F);
    CHECK(strength(light, 169.9) == 0.0F);
    CHECK(strength(light, 171.0) == doctest::Approx(0.5));
    CHECK(strength(light, 172.0) == 1.0F);
    CHECK(strength(light, 230.0) == 1.0F);
    CHECK(strength(light, 231.0) == doctest::Approx(0.5));
    CHECK(strength(light, 232.0) == 0.0F);
    CHECK(strength(light, 171.0 + flight_s) == doctest::Approx(0.5));
}

TEST_CASE("point lights: one may be on past the flight's end") {
    const assets::PointLight light = lamp_on(230.0, 10.0, 1.0F);
    CHECK(strength(light, 0.0) == 1.0F);
    CHECK(strength(light, 239.99) == 1.0F);
    CHECK(strength(light, 10.5) == doctest::Approx(0.5));
    CHECK(strength(light, 120.0) == 0.0F);
}

TEST_CASE("point lights: strength changes without a jump, and without hours it is always full") {
    const assets::PointLight light = lamp_on(20.0, 21.0, 3.0F); // off before it is full
    float before = strength(light, 19.0);
    for (double s = 19.0; s < 28.0; s += 0.01) {
        const float now = strength(light, s);
        CHECK(std::abs(now - before) < 0.01F);
        before = now;
    }
    CHECK(strength(assets::PointLight(), 77.7) == 1.0F);
}

TEST_CASE("point lights: flicker takes its share at most, and no two lights flicker together") {
    assets::PointLight flame;
    flame.flicker = 0.4F;
    float least = 1.0F;
    float most = 0.0F;
    float apart = 0.0F;
    for (double s = 0.0; s < 60.0; s += 0.05) {
        const float now = strength(flame, s);
        least = std::min(least, now);
        most = std::max(most, now);
        apart = std::max(apart, std::abs(now - strength(flame, s, 1)));
        CHECK(now == strength(flame, s));
    }
    CHECK(least >= 0.6F);
    CHECK(least < 0.7F);
    CHECK(most <= 1.0F);
    CHECK(most > 0.9F);
    CHECK(apart > 0.1F);
    const double month_s = 30.0 * 86400.0;
    CHECK(std::abs(strength(flame, month_s) - strength(flame, month_s + 0.001)) < 0.02F);
}
