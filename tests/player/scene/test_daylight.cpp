#include "scene/daylight.hpp"

#include <doctest/doctest.h>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <cmath>

using namespace paradize;

namespace {

assets::SkyLight light(float azimuth_deg, float elevation_deg, float intensity) {
    return {glm::radians(azimuth_deg), glm::radians(elevation_deg), glm::vec3(1.0F, 0.8F, 0.6F), intensity};
}

assets::DaytimeKey key(double at_s, const assets::SkyLight &sun, const assets::SkyLight &moon, float ambient,
                       float exposure) {
    assets::DaytimeKey out;
    out.at_s = at_s;
    out.sun = sun;
    out.moon = moon;
    out.ambient = {glm::vec3(0.5F, 0.6F, 0.8F), ambient};
    out.fog = {glm::vec3(ambient), 0.001F};
    out.exposure = exposure;
    return out;
}

/// Day, sunset, dusk, night and dawn on a flight of 100 s.
assets::SceneFile day_and_night() {
    assets::SceneFile out;
    out.flight.duration_s = 100.0;
    out.daytime = {key(5.0, light(100.0F, 40.0F, 4.0F), light(20.0F, -30.0F, 0.0F), 0.3F, 1.0F),
                   key(40.0, light(250.0F, 5.0F, 2.0F), light(90.0F, -5.0F, 0.0F), 0.2F, 1.2F),
                   key(50.0, light(255.0F, -6.0F, 0.0F), light(100.0F, 5.0F, 0.0F), 0.1F, 1.8F),
                   key(60.0, light(260.0F, -14.0F, 0.0F), light(110.0F, 20.0F, 0.3F), 0.05F, 2.5F),
                   key(90.0, light(80.0F, -6.0F, 0.0F), light(350.0F, 10.0F, 0.0F), 0.1F, 1.8F)};
    return out;
}

float brightness(const glm::vec3 &c) {
    return c.x + c.y + c.z;
}

} // namespace

TEST_CASE("daylight: a scene without keys has its own light at all times") {
    assets::SceneFile file;
    file.sun = {glm::vec3(0.6F, 0.8F, 0.0F), glm::vec3(1.0F, 0.5F, 0.25F), 4.0F, 0.01F};
    file.ambient = {glm::vec3(0.5F), 0.5F};
    file.fog = {glm::vec3(0.7F), 0.002F};
    file.exposure = 0.9F;
    for (const double second : {0.0, 33.3, 239.9}) {
        const Daylight now = daylight_at(file, second);
        CHECK(now.to_light == file.sun.direction);
        CHECK(now.radiance == glm::vec3(4.0F, 2.0F, 1.0F));
        CHECK(now.angular_radius_rad == 0.005F);
        CHECK(now.ambient == glm::vec3(0.25F));
        CHECK(now.fog == glm::vec3(0.7F));
        CHECK(now.exposure == 0.9F);
        CHECK(now.night == 0.0F);
        CHECK(now.haze_glow == 1.0F);
    }
}

TEST_CASE("daylight: at a key the light is that of the key") {
    const assets::SceneFile file = day_and_night();
    for (const assets::DaytimeKey &at : file.daytime) {
        const Daylight now = daylight_at(file, at.at_s);
        CHECK(glm::distance(now.sun.radiance, at.sun.color * at.sun.intensity) < 1e-5F);
        CHECK(glm::distance(now.moon.radiance, at.moon.color * at.moon.intensity) < 1e-5F);
        CHECK(now.sun.direction.y == doctest::Approx(std::sin(at.sun.elevation_rad)).epsilon(1e-5));
        CHECK(now.exposure == doctest::Approx(at.exposure));
        CHECK(glm::distance(now.ambient, at.ambient.color * at.ambient.intensity) < 1e-5F);
    }
}

TEST_CASE("daylight: nothing jumps along the flight, nor where it closes") {
    const assets::SceneFile file = day_and_night();
    Daylight before = daylight_at(file, 0.0);
    constexpr int steps = 5000;
    for (int i = 1; i <= steps; ++i) {
        const double second = 100.0 * i / steps;
        const Daylight now = daylight_at(file, second < 100.0 ? second : 0.0);
        CHECK(glm::distance(now.radiance, before.radiance) < 0.06F);
        CHECK(glm::distance(now.sun.direction, before.sun.direction) < 0.01F);
        CHECK(glm::distance(now.ambient, before.ambient) < 0.002F);
        CHECK(glm::distance(now.fog, before.fog) < 0.002F);
        CHECK(std::abs(now.exposure - before.exposure) < 0.01F);
        CHECK(std::abs(now.night - before.night) < 0.01F);
        CHECK(std::abs(now.haze_glow - before.haze_glow) < 0.03F);
        if (now.by_moon != before.by_moon) { // it casts no shadow while it changes
            CHECK(brightness(now.radiance) < 1e-3F);
            CHECK(brightness(before.radiance) < 1e-3F);
        }
        before = now;
    }
}

TEST_CASE("daylight: the light that casts the shadows turns in as many steps a second as asked for, and is "
          "never further "
          "than one behind") {
    const assets::SceneFile file = day_and_night();
    for (const double steps_per_s : {5.0, 10.0}) {
        int steps = 0;
        glm::vec3 before(0.0F);
        for (int i = 0; i < 400; ++i) {
            const double second = 20.001 + 0.005 * i; // two seconds
            const Daylight now = daylight_at(file, second, steps_per_s);
            steps += now.to_light != before ? 1 : 0;
            before = now.to_light;
            CHECK(glm::distance(now.to_light, now.sun.direction) < 0.15 / steps_per_s);
        }
        CHECK(steps == static_cast<int>(2.0 * steps_per_s));
    }
}

TEST_CASE("daylight: values between two keys lie between theirs") {
    const assets::SceneFile file = day_and_night();
    for (std::size_t i = 0; i + 1 < file.daytime.size(); ++i) {
        const assets::DaytimeKey &a = file.daytime[i];
        const assets::DaytimeKey &b = file.daytime[i + 1];
        for (double share = 0.05; share < 1.0; share += 0.1) {
            const Daylight now = daylight_at(file, a.at_s + share * (b.at_s - a.at_s));
            const auto within = [](float value, float one, float other) {
                CHECK(value >= std::min(one, other) - 1e-5F);
                CHECK(value <= std::max(one, other) + 1e-5F);
            };
            within(now.exposure, a.exposure, b.exposure);
            within(now.sun.radiance.x, a.sun.intensity, b.sun.intensity);
            within(now.ambient.x, 0.5F * a.ambient.intensity, 0.5F * b.ambient.intensity);
            within(now.sun.direction.y, std::sin(a.sun.elevation_rad), std::sin(b.sun.elevation_rad));
        }
    }
}

TEST_CASE("daylight: a light that is below the horizon lights nothing, whatever its key says") {
    assets::SceneFile file = day_and_night();
    file.daytime[2].sun.intensity = 1.0F;
    CHECK(brightness(daylight_at(file, 50.0).radiance) == 0.0F);
    CHECK(brightness(daylight_at(file, 50.0).sun.radiance) > 2.0F);
}

TEST_CASE("daylight: at night the moon casts the shadows, and it is night where the sun is deep below the "
          "horizon") {
    const assets::SceneFile file = day_and_night();
    CHECK(daylight_at(file, 65.0).by_moon);
    CHECK(daylight_at(file, 65.0).night == doctest::Approx(1.0F));
    CHECK_FALSE(daylight_at(file, 20.0).by_moon);
    CHECK(daylight_at(file, 20.0).night == 0.0F);
    CHECK(daylight_at(file, 65.0).to_light.y > 0.2F);
    CHECK(daylight_at(file, 65.0).angular_radius_rad == 0.5F * file.moon_diameter_rad);
    CHECK(daylight_at(file, 20.0).angular_radius_rad == 0.5F * file.sun.angular_diameter_rad);
    CHECK(daylight_at(file, 65.0).haze_glow < 0.5F);
    CHECK(daylight_at(file, 20.0).haze_glow == 1.0F);
}

TEST_CASE("daylight: lights turn the shorter way") {
    const assets::SceneFile file = day_and_night(); // the moon from 350 degrees to 20, through north
    const Daylight now = daylight_at(file, 97.5);
    CHECK(now.moon.direction.z < -0.8F);
}

TEST_CASE("daylight: a key's sky turns with the light that it was made for") {
    const assets::SceneFile file = day_and_night();
    const Daylight now = daylight_at(file, 22.0);
    CHECK(now.sky.key == std::array<std::size_t, 2>{0, 1});
    const double azimuth =
        std::atan2(static_cast<double>(now.sun.direction.x), static_cast<double>(-now.sun.direction.z));
    for (const float turn : now.sky.turn_rad) {
        CHECK(std::abs(std::remainder(static_cast<double>(turn) - azimuth, glm::two_pi<double>())) < 1e-3);
    }
    const Daylight night = daylight_at(file, 60.0); // its key's light is the moon
    CHECK(night.sky.key[0] == 3);
    CHECK(std::abs(night.sky.turn_rad[0] - glm::radians(110.0F)) < 1e-3F);
    // From the last key to the first.
    CHECK(daylight_at(file, 1.0).sky.key == std::array<std::size_t, 2>{4, 0});
}

TEST_CASE("daylight: clouds end where they began") {
    assets::SceneFile file = day_and_night();
    file.clouds = assets::Clouds{"clouds", 0.5F, 3, 2};
    const double width = glm::two_pi<double>() / 3.0;
    const auto apart = [&](double one, double other) {
        const double turned = static_cast<double>(daylight_at(file, one).clouds_turn_rad) -
                              static_cast<double>(daylight_at(file, other).clouds_turn_rad);
        return std::abs(std::remainder(turned, width));
    };
    CHECK(apart(99.999, 0.0) < 1e-3);
    CHECK(apart(0.0, 25.0) > 0.4 * width); // they move: half a width in a quarter of the flight
}
