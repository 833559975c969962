#include "scene/sound_field.hpp"

#include <doctest/doctest.h>
#include <glm/geometric.hpp>

#include <array>
#include <cmath>
#include <limits>

using namespace paradize;

namespace {

/// Looks north, along -Z.
Pose at(const glm::dvec3 &eye) {
    return {eye, eye + glm::dvec3(0.0, 0.0, -1.0), 0.0};
}

assets::Sound from(std::vector<glm::dvec3> places, float radius_m = 1.0F, float falloff = 1.0F) {
    assets::Sound sound;
    sound.places = std::move(places);
    sound.radius_m = radius_m;
    sound.falloff = falloff;
    return sound;
}

/// The energy vector of a line, summed over many of its points.
glm::dvec3 summed(const assets::Sound &sound, const glm::dvec3 &eye) {
    const double soft = 0.25 * static_cast<double>(sound.radius_m * sound.radius_m);
    double power = 0.0;
    glm::dvec3 flow(0.0);
    for (std::size_t i = 1; i < sound.places.size(); ++i) {
        const glm::dvec3 a = sound.places[i - 1] - eye;
        const glm::dvec3 b = sound.places[i] - eye;
        constexpr int steps = 20000;
        for (int k = 0; k < steps; ++k) {
            const glm::dvec3 to = a + (b - a) * ((k + 0.5) / steps);
            const double squared = glm::dot(to, to) + soft;
            const double weight = glm::length(b - a) / squared;
            power += weight;
            flow += to / std::sqrt(squared) * weight;
        }
    }
    return flow / power;
}

} // namespace

TEST_CASE("sound: full volume up to the radius, then falloff times 6 dB at each doubling of the distance") {
    for (const float falloff : {0.0F, 0.5F, 1.0F, 2.0F}) {
        const assets::Sound sound = from({{0.0, 0.0, 0.0}}, 4.0F, falloff);
        CHECK(hear(sound, at({0.0, 0.0, 3.9}), 0.0, 10.0).gain == 1.0F);
        for (const double d : {8.0, 16.0, 1000.0}) {
            const float wanted = std::pow(static_cast<float>(4.0 / d), falloff);
            CHECK(hear(sound, at({0.0, 0.0, d}), 0.0, 10.0).gain == doctest::Approx(wanted));
        }
    }
}

TEST_CASE("sound: it comes from its place, seen from the eye that turns and rolls") {
    const assets::Sound sound = from({{50.0, 0.0, 0.0}}); // in the east
    CHECK(hear(sound, at({0.0, 0.0, 0.0}), 0.0, 1.0).direction.x == doctest::Approx(1.0F).epsilon(1e-3));
    const Pose east{{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, 0.0};
    CHECK(hear(sound, east, 0.0, 1.0).direction.z == doctest::Approx(-1.0F).epsilon(1e-3));
    const Pose south{{0.0, 0.0, 0.0}, {0.0, 0.0, 1.0}, 0.0};
    CHECK(hear(sound, south, 0.0, 1.0).direction.x == doctest::Approx(-1.0F).epsilon(1e-3));
    const Pose rolled{{0.0, 0.0, 0.0}, {0.0, 0.0, -1.0}, 1.5707963267948966};
    CHECK(std::abs(hear(sound, rolled, 0.0, 1.0).direction.y) == doctest::Approx(1.0F).epsilon(1e-3));
}

TEST_CASE("sound: far from the origin it is heard as near to it") {
    const glm::dvec3 far(3e8, 0.0, -5e8);
    const HeardSound there = hear(from({far + glm::dvec3(3.0, 1.0, -2.0)}), at(far), 0.0, 1.0);
    const HeardSound here = hear(from({{3.0, 1.0, -2.0}}), at(glm::dvec3(0.0)), 0.0, 1.0);
    CHECK(there.gain == doctest::Approx(here.gain).epsilon(1e-6));
    CHECK(glm::length(there.direction - here.direction) < 1e-6F);
}

TEST_CASE("sound: a line is as loud as its nearest point, and comes from the mean of all its points") {
    const assets::Sound shore = from({{-30.0, 0.0, -8.0}, {10.0, 0.0, -8.0}, {25.0, 0.0, 20.0}}, 2.0F, 0.5F);
    for (const glm::dvec3 &eye : {glm::dvec3(0.0, 1.5, 0.0), glm::dvec3(-60.0, 3.0, 5.0),
                                  glm::dvec3(12.0, 0.5, -7.0), glm::dvec3(0.0, 400.0, 0.0)}) {
        const HeardSound heard = hear(shore, at(eye), 0.0, 1.0);
        double nearest = std::numeric_limits<double>::infinity();
        for (std::size_t i = 1; i < shore.places.size(); ++i) {
            for (int k = 0; k <= 4000; ++k) {
                const glm::dvec3 point = glm::mix(shore.places[i - 1], shore.places[i], k / 4000.0);
                nearest = std::min(nearest, glm::length(point - eye));
            }
        }
        CHECK(heard.gain == doctest::Approx(std::sqrt(2.0 / std::max(nearest, 2.0))).epsilon(1e-3));
        CHECK(glm::length(glm::dvec3(heard.direction) - summed(shore, eye)) < 1e-3);
    }
}

TEST_CASE(
    "sound: along a long line it is spread, and where the line runs round the eye it has no direction") {
    const HeardSound straight = hear(from({{-1e5, 0.0, -9.0}, {1e5, 0.0, -9.0}}, 0.1F), at({}), 0.0, 1.0);
    CHECK(straight.direction.z == doctest::Approx(-2.0 / 3.141592653589793).epsilon(1e-3));
    std::vector<glm::dvec3> circle;
    for (int i = 0; i <= 64; ++i) {
        circle.emplace_back(20.0 * std::cos(i * 0.09817477042468103), 0.0,
                            20.0 * std::sin(i * 0.09817477042468103));
    }
    CHECK(glm::length(hear(from(circle), at({}), 0.0, 1.0).direction) < 1e-4F);
}

TEST_CASE("sound: nothing jumps where the eye passes through a place or a line") {
    for (const assets::Sound &sound :
         {from({{0.0, 0.0, 0.0}}, 2.0F), from({{0.0, 0.0, -9.0}, {0.0, 0.0, 9.0}}, 2.0F)}) {
        HeardSound before = hear(sound, at({-5.0, 0.0, 0.0}), 0.0, 1.0);
        for (double x = -5.0; x < 5.0; x += 0.02) {
            const HeardSound now = hear(sound, at({x, 0.0, 0.0}), 0.0, 1.0);
            CHECK(glm::length(now.direction - before.direction) < 0.04F);
            CHECK(std::abs(now.gain - before.gain) < 0.02F);
            before = now;
        }
    }
}

TEST_CASE("sound: a short line far away comes from where it is") {
    for (double away = 1e7; away < 1e8; away += 3e6) {
        const HeardSound heard = hear(from({{away, 0.0, 0.0}, {away + 1.0, 0.0, 0.0}}), at({}), 0.0, 1.0);
        CHECK(heard.direction.x == doctest::Approx(1.0F).epsilon(0.01));
    }
}

TEST_CASE("sound: finite and within 0 to 1 for all places, also a line of no length") {
    const std::array places{glm::dvec3(0.0), glm::dvec3(1e-9, 0.0, 0.0), glm::dvec3(1e10, -1e10, 1e10),
                            glm::dvec3(-1e10, 0.0, 0.0), glm::dvec3(1.0, 2.0, 3.0)};
    for (const glm::dvec3 &a : places) {
        for (const glm::dvec3 &b : places) {
            for (const glm::dvec3 &eye : places) {
                for (const assets::Sound &sound :
                     {from({a}, 1e-3F), from({a, b}, 1e-3F), from({a, b}, 1e7F)}) {
                    const HeardSound heard = hear(sound, at(eye), 0.0, 1.0);
                    CHECK((heard.gain >= 0.0F && heard.gain <= 1.0F));
                    CHECK(glm::length(heard.direction) <= 1.0001F); // false for NaN
                }
            }
        }
    }
}

TEST_CASE("sound: hours fade in and out on the circle of the flight") {
    const assets::SoundHours night{200.0, 20.0, 10.0};
    for (const auto &[second, gain] : {std::array{199.0, 0.0},
                                       {205.0, 0.5},
                                       {210.0, 1.0},
                                       {235.0, 1.0},
                                       {239.999, 1.0},
                                       {0.0, 1.0},
                                       {10.0, 1.0},
                                       {15.0, 0.5},
                                       {20.0, 0.0},
                                       {100.0, 0.0},
                                       {240.0 * 7.0 + 205.0, 0.5}}) {
        CHECK(gain_of_hours(night, second, 240.0) == doctest::Approx(gain).epsilon(1e-5));
    }
    const assets::SoundHours day{20.0, 200.0, 10.0};
    for (const double second : {0.0, 22.5, 25.0, 30.0, 193.0, 199.0, 201.0}) {
        CHECK(gain_of_hours(day, second, 240.0) + gain_of_hours({200.0, 20.0, 10.0}, second, 240.0) <= 1.01F);
    }
    assets::Sound sound;
    sound.hours = night;
    CHECK(hear(sound, at({}), 205.0, 240.0).gain == doctest::Approx(0.5F));
}
