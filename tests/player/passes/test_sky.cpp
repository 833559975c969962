#include "context.hpp"
#include "sky_probe.hpp"

#include <doctest/doctest.h>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

using namespace paradize;
using test::SkyPatch;

namespace {

constexpr int sky_px = SkyPatch::side_px;

glm::vec3 at_elevation(double degrees) {
    const double angle = degrees * M_PI / 180.0;
    return {std::cos(angle), std::sin(angle), 0.0};
}

/// Green light of a patch: radiance times solid angle.
double irradiance(const std::vector<glm::dvec3> &patch, double pixels_per_rad) {
    double sum = 0.0;
    for (const glm::dvec3 &color : patch) {
        sum += color.g;
    }
    return sum / (pixels_per_rad * pixels_per_rad);
}

/// 1, and 50 in the four texels around +Z.
glm::vec3 sun_of_four_texels(const glm::vec3 &d) {
    return glm::vec3(d.z > std::cos(0.4 * M_PI / 180.0) ? 50.0F : 1.0F);
}

} // namespace

TEST_CASE("sky: an infinite texel is drawn as the brightest finite light, also through haze") {
    if (!test::have_context()) {
        return;
    }
    const auto infinite = [](const glm::vec3 &) { return glm::vec3(std::numeric_limits<float>::infinity()); };
    for (const std::string fragment : {"sky.frag", "daytime_sky.frag"}) {
        SkyPatch sky(fragment);
        sky.cube = test::float_cube(2, infinite);
        sky.day.before = test::float_cube(2, infinite);
        sky.day.after = test::float_cube(2, infinite);
        CHECK(sky.in(at_elevation(30.0)).g == 60.0);
        sky.frame.fog = {0.5F, 0.5F, 0.5F, 0.05F};
        CHECK(sky.in(at_elevation(30.0)).g > 10.0);
        CHECK(sky.in(at_elevation(30.0)).g < 60.0);
        CHECK(sky.in(at_elevation(-3.0)).g == doctest::Approx(0.5));
    }
    test::DaytimeSky day(glm::vec3(0.0F));
    day.before = test::float_cube(2, infinite);
    day.after = test::float_cube(2, infinite);
    test::ShaderProbe faces(6, test::covering_vertex, "environment.frag");
    day.apply(faces);
    faces.set("u_face_px", {1.0F});
    faces.set("u_pixels_per_rad", {1.0F});
    CHECK(faces.draw()[1] == 60.0F);
}

TEST_CASE("sky: haze hides the horizon, and upwards as much as a surface at the end of the ray in it") {
    if (!test::have_context()) {
        return;
    }
    for (const std::string fragment : {"sky.frag", "daytime_sky.frag"}) {
        SkyPatch sky(fragment);
        sky.day = test::DaytimeSky(glm::vec3(1.0F));
        sky.frame.fog = {0.0F, 0.0F, 0.0F, 0.004F}; // black: what is left is the sky
        double before = sky.in(at_elevation(0.05)).b;
        CHECK(before < 1e-3);
        for (const double degrees : {2.0, 5.0, 10.0, 20.0, 45.0, 90.0}) {
            const glm::dvec3 now = sky.in(at_elevation(degrees));
            CHECK(now.b > before);
            CHECK(now.r > now.g); // haze takes blue first
            CHECK(now.g > now.b);
            before = now.b;
        }
        CHECK(before == test::within(std::exp(-10.0 * 0.004 * 1.28), 1e-3)); // a layer of 10 m
        CHECK(sky.in(at_elevation(-10.0)).b < 1e-3);
    }
}

TEST_CASE("sky: haze is brighter towards the sun by day, and not away from it") {
    if (!test::have_context()) {
        return;
    }
    for (const std::string fragment : {"sky.frag", "daytime_sky.frag"}) {
        SkyPatch sky(fragment);
        sky.frame.fog = {0.4F, 0.4F, 0.4F, 1.0F};
        sky.frame.sun_direction = glm::vec4(at_elevation(10.0), 0.005F);
        sky.frame.daylight.y = 1.0F;
        const double towards = sky.in({1.0F, 0.0F, 0.0F}).g, aside = sky.in({0.0F, 0.0F, 1.0F}).g,
                     away = sky.in({-1.0F, 0.0F, 0.0F}).g;
        CHECK(towards > 1.2 * aside);
        CHECK(towards < 1.5 * aside);
        CHECK(aside == doctest::Approx(0.4));
        CHECK(away == doctest::Approx(0.4));
        const double cosine = std::cos(M_PI / 6.0) * std::cos(M_PI / 18.0); // 30 degrees beside it
        CHECK(sky.in({std::cos(static_cast<float>(M_PI / 6.0)), 0.0F, 0.5F}).g ==
              test::within(0.4 * (1.0 + 0.35 * std::pow(cosine, 8.0)), 0.001));
        sky.frame.daylight.y = 0.0F;
        CHECK(sky.in({1.0F, 0.0F, 0.0F}).g == doctest::Approx(0.4));
    }
}

TEST_CASE("sky: an eye under water sees the water's own light in its place, the mirror's eye does not") {
    if (!test::have_context()) {
        return;
    }
    for (const std::string fragment : {"sky.frag", "daytime_sky.frag"}) {
        SkyPatch sky(fragment);
        sky.day = test::DaytimeSky(glm::vec3(1.0F));
        sky.water_glow = {0.1F, 0.2F, 0.3F};
        sky.frame.water.w = 2.0F; // the eye is at 1 m
        CHECK(glm::length(sky.in(at_elevation(40.0)) - glm::dvec3(sky.water_glow)) < 1e-6);
        sky.frame.lens.w = 1.0F;
        CHECK(sky.in(at_elevation(40.0)).g == doctest::Approx(1.0));
        sky.frame.lens.w = 0.0F;
        sky.frame.water.w = 0.5F;
        CHECK(sky.in(at_elevation(40.0)).g == doctest::Approx(1.0));
    }
}

TEST_CASE("sky: the mirror view shows the sky beside the sun in place of its disc") {
    if (!test::have_context()) {
        return;
    }
    SkyPatch sky("sky.frag");
    sky.cube = test::float_cube(256, sun_of_four_texels);
    sky.frame.sun_direction = {0.0F, 0.0F, 1.0F, 0.005F};
    const double pixels_per_rad = sky_px / 0.07; // two degrees to each side
    const auto brightest = [&] {
        double most = 0.0;
        for (const glm::dvec3 &color : sky.around({0.0F, 0.0F, 1.0F}, pixels_per_rad)) {
            most = std::max(most, color.g);
            CHECK(color.g > 0.999);
        }
        return most;
    };
    CHECK(brightest() > 40.0);
    sky.frame.lens.w = 1.0F;
    CHECK(brightest() < 1.001);
    // Where the sky beside it is brighter on the right, it is so in the disc's place.
    sky.cube = test::float_cube(256, [](const glm::vec3 &d) { return sun_of_four_texels(d) - 20.0F * d.x; });
    const auto disc = sky.around({0.0F, 0.0F, 1.0F}, pixels_per_rad); // -X is on the right
    for (const int off : {-12, 12}) {                                 // of 16 pixels to the rim
        const double wanted = 1.0 + 20.0 * (off + 0.5) / pixels_per_rad;
        CHECK(std::abs(disc[static_cast<std::size_t>(sky_px / 2 * (sky_px + 1) + off)].g - wanted) < 0.15);
    }
}

TEST_CASE("sky: a disc gives its radiance times its solid angle, and the mirror view shows none") {
    if (!test::have_context()) {
        return;
    }
    SkyPatch sky("daytime_sky.frag");
    sky.sun = sky.moon = at_elevation(30.0);
    for (const double radius : {0.03, 0.01, 0.004}) {
        constexpr double pixels_per_rad = 700.0;
        sky.sun_disc = {5.0F, 5.0F, 5.0F, static_cast<float>(radius)};
        sky.frame.lens.w = 0.0F;
        const double found = irradiance(sky.around(sky.sun, pixels_per_rad), pixels_per_rad);
        // An edge as wide as two pixels adds to it as a pixel does on all sides.
        const double slack = std::pow(0.5 / (radius * pixels_per_rad), 2.0) + 0.01;
        CHECK(found == test::within(5.0 * M_PI * radius * radius, slack));
        sky.frame.lens.w = 1.0F;
        CHECK(irradiance(sky.around(sky.sun, pixels_per_rad), pixels_per_rad) == 0.0);
    }
}

TEST_CASE("sky: the air glows around the light, ever less away from it") {
    if (!test::have_context()) {
        return;
    }
    SkyPatch sky("daytime_sky.frag");
    sky.day.light_direction = at_elevation(30.0);
    sky.day.light_radiance = {2.0F, 1.0F, 0.5F};
    double before = sky.in(at_elevation(30.0)).g;
    CHECK(before < 1.0); // less than the light itself
    CHECK(before > 0.1);
    for (double degrees = 31.0; degrees < 90.0; degrees += 1.0) {
        const glm::dvec3 now = sky.in(at_elevation(degrees));
        CHECK(now.g < before);
        CHECK(now.r == doctest::Approx(2.0 * now.g));
        before = now.g;
    }
    CHECK(sky.in(at_elevation(60.0)).g < 0.005);
}

TEST_CASE("sky: between two keys both are seen by their shares, each turned from north over east") {
    if (!test::have_context()) {
        return;
    }
    SkyPatch sky("daytime_sky.frag");
    const auto bright_in_the_north = [](const glm::vec3 &d) { return glm::vec3(d.z < -0.9F ? 1.0F : 0.0F); };
    sky.day.before = test::float_cube(16, bright_in_the_north);
    sky.day.after = test::float_cube(16, bright_in_the_north);
    sky.day.share = 0.25F;
    sky.day.turns = {std::cos(0.5F), std::sin(0.5F), std::cos(2.0F), std::sin(2.0F)};
    const auto seen = [&](float turn) { return sky.in({std::sin(turn), 0.01F, -std::cos(turn)}).g; };
    CHECK(seen(0.5F) == doctest::Approx(0.75));
    CHECK(seen(2.0F) == doctest::Approx(0.25));
    CHECK(seen(-0.5F) == 0.0);
    CHECK(seen(-2.0F) == 0.0);
}

TEST_CASE("sky: the environment holds the clear sky of each direction, where its cube map will be read") {
    if (!test::have_context()) {
        return;
    }
    constexpr int face_px = 8;
    test::DaytimeSky day(glm::vec3(0.0F));
    const auto coordinates = [](const glm::vec3 &d) { return glm::vec3(2.0F) + d; };
    day.before = test::float_cube(64, coordinates);
    day.after = test::float_cube(64, coordinates);
    test::ShaderProbe faces(6 * face_px, test::covering_vertex, "environment.frag");
    day.apply(faces);
    faces.set("u_face_px", {face_px});
    faces.set("u_pixels_per_rad", {10.0F});
    const std::vector<float> pixels = faces.draw();
    std::vector<glm::vec3> directions; // those of a cube map's texels, face by face
    const auto at_the_east = std::size_t{4} * ((face_px / 2 - 1) * 6 * face_px + face_px / 2);
    const float clear = pixels[at_the_east];
    day.light_direction = {1.0F, 0.0F, 0.0F};
    day.light_radiance = glm::vec3(1.0F);
    day.apply(faces);
    CHECK(faces.draw()[at_the_east] > clear + 0.005F); // the air glows around the light
    day.clouds_fit = {0.16F, 0.0F, 0.5F, 1.0F};
    day.clouds = test::one_color(0.0F, 0.0F, 0.0F, 1.0F);
    day.apply(faces);
    CHECK(faces.draw()[at_the_east] < 0.1F); // behind dark clouds
    test::float_cube(face_px, [&](const glm::vec3 &d) {
        directions.push_back(d);
        return d;
    });
    for (std::size_t i = 0; i < directions.size(); ++i) {
        const std::size_t face = i / (face_px * face_px), row = i / face_px % face_px, column = i % face_px;
        const float *color = &pixels[4 * (row * 6 * face_px + face * face_px + column)];
        CHECK(glm::length(glm::vec3(color[0], color[1], color[2]) - coordinates(directions[i])) < 0.02F);
    }
}
