#include "context.hpp"
#include "sky_probe.hpp"

#include <doctest/doctest.h>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

using namespace paradize;
using test::SkyPatch;

namespace {

constexpr int night_px = SkyPatch::side_px;

double green_sum(const std::vector<glm::dvec3> &patch) {
    double sum = 0.0;
    for (const glm::dvec3 &color : patch) {
        sum += color.g;
    }
    return sum;
}

} // namespace

TEST_CASE("stars: waves leave little of their mirrored light, and night and enlargement their share") {
    if (!test::have_context()) {
        return;
    }
    SkyPatch sky("daytime_sky.frag");
    sky.star_light = 1.0F;
    const glm::vec3 up(0.1F, 1.0F, 0.05F);
    const double all = green_sum(sky.around(up, 150.0));
    CHECK(all > 0.1);
    sky.frame.lens.w = 1.0F;
    const double mirrored = green_sum(sky.around(up, 150.0));
    CHECK(mirrored > 0.1 * all);
    CHECK(mirrored < 0.2 * all);
    sky.frame.lens.w = 0.0F;
    sky.star_light = 0.5F;
    CHECK(green_sum(sky.around(up, 150.0)) == doctest::Approx(0.5 * all));
    sky.star_light = 0.0F;
    CHECK(green_sum(sky.around(up, 150.0)) == 0.0);
}

TEST_CASE("stars: a picture that is drawn smaller and enlarged holds as much of their light") {
    if (!test::have_context()) {
        return;
    }
    SkyPatch sky("daytime_sky.frag");
    sky.star_light = 1.0F;
    const glm::vec3 up(0.1F, 1.0F, 0.05F);
    const auto light_of = [&](double pixels_per_rad, float area) { // of the same stars
        sky.star_area = area;
        double sum = 0.0;
        const auto patch = sky.around(up, pixels_per_rad);
        const int kept = static_cast<int>(0.3 * pixels_per_rad) / 2;
        for (int row = night_px / 2 - kept; row < night_px / 2 + kept; ++row) {
            for (int column = night_px / 2 - kept; column < night_px / 2 + kept; ++column) {
                sum += patch[static_cast<std::size_t>(row * night_px + column)].g;
            }
        }
        return sum / (pixels_per_rad * pixels_per_rad);
    };
    CHECK(light_of(100.0, 0.25F) == test::within(light_of(200.0, 1.0F), 0.05));
}

TEST_CASE("stars: of twice the light there are fewer by 2^1.25, a star in each cell, in colours from warm to "
          "blue") {
    if (!test::have_context()) {
        return;
    }
    constexpr int cells = 46, wide_px = 16 * cells; // one face of the sphere
    test::ShaderProbe probe(wide_px, "#include \"lib/stars.glsl\"\nout vec4 color;\nvoid main() {\n"
                                     "vec2 at = gl_FragCoord.xy / 368.0 - 1.0;\n"
                                     "color = vec4(stars(normalize(vec3(at, 1.0)), 150.0), 1.0); }\n");
    const std::vector<float> pixels = probe.draw();
    std::vector<float> most(std::size_t{cells} * cells);
    double reddest = 10.0, bluest = 0.0;
    for (std::size_t i = 0; i < pixels.size() / 4; ++i) {
        const std::size_t row = i / wide_px, column = i % wide_px;
        float &cell = most[row / 16 * cells + column / 16];
        cell = std::max(cell, pixels[4 * i + 1]);
        if (pixels[4 * i + 1] > 1e-3F) {
            const double blue = pixels[4 * i + 2] / pixels[4 * i];
            reddest = std::min(reddest, blue);
            bluest = std::max(bluest, blue);
        }
    }
    const auto brighter = [&](float flux) {
        return static_cast<double>(std::ranges::count_if(most, [&](float one) { return one > flux; }));
    };
    CHECK(std::ranges::min(most) > 0.003F);
    CHECK(brighter(0.016F) / brighter(0.032F) == test::within(std::pow(2.0, 1.25), 0.15));
    CHECK(brighter(0.032F) / brighter(0.064F) == test::within(std::pow(2.0, 1.25), 0.25));
    CHECK(std::ranges::max(most) <= 1.0F);
    CHECK(reddest < 0.75);
    CHECK(bluest > 1.4);
}

TEST_CASE("moon: a disc, nearly full, lit from the right, that hides the stars behind it") {
    if (!test::have_context()) {
        return;
    }
    SkyPatch sky("daytime_sky.frag");
    sky.moon = glm::normalize(glm::vec3(1.0F, 0.5F, 0.3F));
    constexpr double pixels_per_rad = 700.0, radius = 0.03;
    sky.moon_disc = {2.0F, 2.0F, 2.0F, static_cast<float>(radius)};
    sky.star_light = 1.0F;
    const auto disc = sky.around(sky.moon, pixels_per_rad);
    double right = 0.0, left = 0.0, lit = 0.0, most_beside = 0.0;
    for (std::size_t i = 0; i < disc.size(); ++i) {
        const double x = static_cast<double>(i % night_px) - 31.5,
                     y = static_cast<double>(i / night_px) - 31.5;
        (x > 0.0 ? right : left) += disc[i].g;
        lit += disc[i].g > 0.3 ? 1.0 : 0.0;
        CHECK(disc[i].g < 2.01);
        if (std::hypot(x, y) > radius * pixels_per_rad + 2.0) {
            most_beside = std::max(most_beside, disc[i].g);
        }
    }
    CHECK(right > 1.1 * left);
    CHECK(lit > 0.75 * M_PI * std::pow(radius * pixels_per_rad, 2.0));
    CHECK(lit < 1.03 * M_PI * std::pow(radius * pixels_per_rad, 2.0));
    CHECK(most_beside < 1.0); // a star at most
    // Behind a black moon is nothing.
    sky.moon_disc = {0.0F, 0.0F, 0.0F, 0.04F};
    sky.day = test::DaytimeSky(glm::vec3(0.5F));
    const auto hidden = sky.around(sky.moon, pixels_per_rad);
    CHECK(hidden[night_px / 2 * (night_px + 1)].g < 0.01);
    sky.frame.lens.w = 1.0F;
    CHECK(sky.around(sky.moon, pixels_per_rad)[night_px / 2 * (night_px + 1)].g > 0.49);
}

TEST_CASE("clouds: they shine towards the light by the phase function, and not where they are thick") {
    if (!test::have_context()) {
        return;
    }
    SkyPatch sky("daytime_sky.frag");
    sky.day.clouds_fit = {0.16F, 0.0F, 0.5F, 1.0F}; // up to 2 rad high
    sky.day.light_direction = {1.0F, 0.0F, 0.0F};
    sky.day.light_radiance = {1.0F, 1.0F, 1.0F};
    const glm::vec3 towards(1.0F, 0.05F, 0.0F), aside(0.0F, 0.05F, 1.0F);
    const auto radiance = [&](float thickness, const glm::vec3 &direction) { // of the clouds alone
        sky.day.clouds = test::one_color(0.0F, 0.0F, 0.0F, thickness);
        const double with = sky.in(direction).g;
        sky.day.clouds = test::one_color(0.0F, 0.0F, 0.0F, 0.0F);
        return (with - (1.0 - static_cast<double>(thickness)) * sky.in(direction).g) /
               static_cast<double>(thickness);
    };
    const auto henyey_greenstein = [](double cosine) { return std::pow(1.5625 - 1.5 * cosine, -1.5); };
    const double ratio = radiance(0.5F, towards) / radiance(0.5F, aside);
    CHECK(ratio ==
          test::within(henyey_greenstein(1.0 / std::hypot(1.0, 0.05)) / henyey_greenstein(0.0), 0.02));
    CHECK(radiance(1.0F, towards) < 1e-4);
    CHECK(radiance(0.5F, towards) > radiance(0.9F, towards));
}

TEST_CASE("clouds: the map begins in the north, turns to the east and with the time, and ends at its edges") {
    if (!test::have_context()) {
        return;
    }
    SkyPatch sky("daytime_sky.frag");
    constexpr int columns = 64;
    std::vector<float> texels; // blue: as far along the map
    for (int i = 0; i < columns; ++i) {
        texels.insert(texels.end(), {0.0F, 0.0F, (static_cast<float>(i) + 0.5F) / columns, 1.0F});
    }
    sky.day.clouds = test::float_texture(columns, 1, texels);
    sky.day.light_radiance = {1.0F, 1.0F, 1.0F}; // from straight above, as if it were far away
    sky.day.clouds_fit = {0.1F, -0.5F, 2.0F, 1.0F};
    const auto at = [&](double azimuth, double elevation) {
        const double c = std::cos(elevation);
        return sky
            .in({static_cast<float>(c * std::sin(azimuth)), static_cast<float>(std::sin(elevation)),
                 static_cast<float>(-c * std::cos(azimuth))})
            .g;
    };
    for (const double azimuth : {-2.0, -0.5, 0.0, 1.0, 3.0}) {
        CHECK(at(azimuth, 0.1) == test::within(0.62 * (0.5 + 0.1 * azimuth), 0.02));
    }
    CHECK(at(0.0, -0.02) == doctest::Approx(at(0.0, 0.6)).epsilon(1e-2)); // none above and below
    CHECK(at(0.0, 0.6) < 0.02);
}

TEST_CASE("clouds: a light from the right shows what was baked for it, wherever the eye looks") {
    if (!test::have_context()) {
        return;
    }
    SkyPatch sky("daytime_sky.frag");
    sky.day.clouds_fit = {0.16F, 0.0F, 0.5F, 1.0F};
    sky.day.clouds = test::one_color(0.8F, 0.2F, 0.0F, 1.0F);
    sky.day.light_radiance = {1.0F, 1.0F, 1.0F};
    for (const float azimuth : {0.0F, 1.0F, 2.5F, -2.0F}) {
        const glm::vec3 direction(std::sin(azimuth), 0.2F, -std::cos(azimuth));
        const glm::vec3 right(std::cos(azimuth), 0.0F, std::sin(azimuth));
        sky.day.light_direction = right;
        CHECK(sky.in(direction).g == test::within(0.62 * 0.8, 0.01));
        sky.day.light_direction = -right;
        CHECK(sky.in(direction).g == test::within(0.62 * 0.2, 0.01));
    }
}

TEST_CASE("clouds: a light from any side and above finds a white cloud as bright, one behind it less") {
    if (!test::have_context()) {
        return;
    }
    SkyPatch sky("daytime_sky.frag");
    sky.day.clouds_fit = {0.16F, 0.0F, 0.5F, 1.0F};
    sky.day.clouds = test::one_color(1.0F, 1.0F, 1.0F, 1.0F);
    sky.day.light_radiance = {1.0F, 1.0F, 1.0F};
    const auto lit_from = [&](const glm::vec3 &light) {
        sky.day.light_direction = glm::normalize(light);
        return sky.in({0.0F, 0.2F, -1.0F}).g; // northwards
    };
    const double above = lit_from({0.0F, 1.0F, 0.0F});
    CHECK(above > 0.5);
    CHECK(above < 0.8);
    for (const glm::vec3 &light : {glm::vec3(1.0F, 0.0F, 0.0F), glm::vec3(-1.0F, 0.3F, 0.0F),
                                   glm::vec3(0.0F, 0.2F, 1.0F), glm::vec3(-0.4F, 0.5F, 0.6F)}) {
        CHECK(lit_from(light) == test::within(above, 0.01));
    }
    CHECK(lit_from({0.0F, 0.1F, -1.0F}) < 0.6 * above);
}
