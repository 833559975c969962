#include "context.hpp"
#include "sea_probe.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

using namespace paradize;
using test::SeaProbe;

namespace {

std::vector<double> greens(const std::vector<glm::dvec4> &colors) {
    std::vector<double> out;
    for (const glm::dvec4 &color : colors) {
        out.push_back(color.g);
    }
    return out;
}

/// A black sea under a black sky: what is seen of it is glitter.
void darken(SeaProbe &sea) {
    sea.sky = SeaProbe::one_sky(glm::vec3(0.0F));
    sea.frame.water.x = sea.frame.water.y = sea.frame.water.z = 1.0F;
}

} // namespace

TEST_CASE("sea: far away its waves mirror a higher part of the sky, and less of it") {
    if (!test::have_context()) {
        return;
    }
    SeaProbe calm, sea;
    sea.wave_length_m = 1.0F;
    calm.frame.eye.y = sea.frame.eye.y = 0.5F;
    const auto of_calm = [&](float distance_m) {
        return sea.at({distance_m, 0.0F}).g / calm.at({distance_m, 0.0F}).g;
    };
    CHECK(of_calm(2.0F) == test::within(1.0, 0.01)); // waves are seen one by one
    double before = of_calm(5.0F);
    for (float distance_m = 10.0F; distance_m < 3000.0F; distance_m *= 1.7F) {
        const double now = of_calm(distance_m);
        CHECK(now < before);
        before = now;
    }
    CHECK(before > 0.5); // slopes of some 6 degrees: 0.6 in E. Bruneton et al., 2010, figure 5
    CHECK(before < 0.7);
    CHECK(of_calm(30.0F) > 0.65); // half of the way where a pixel holds some
    CHECK(of_calm(30.0F) < 0.92);
    // A sky that is as bright as it is high.
    const auto height = [](const glm::vec3 &d) { return glm::vec3(std::max(d.y, 0.0F)); };
    sea.sky = test::float_cube(64, height);
    calm.sky = test::float_cube(64, height);
    calm.frame.eye.y = sea.frame.eye.y = 30.0F; // the horizon's haze is farther away
    CHECK(calm.at({1000.0F, 0.0F}).g < 0.035);
    CHECK(sea.at({1000.0F, 0.0F}).g / before > 0.17); // 10 degrees and more
    CHECK(sea.at({1000.0F, 0.0F}).g / before < 0.3);
}

TEST_CASE("sea: glitter of waves smaller than a pixel is wider and dimmer") {
    if (!test::have_context()) {
        return;
    }
    SeaProbe sea;
    darken(sea);
    sea.frame.eye.y = 2.0F;
    sea.frame.sun_direction = glm::vec4(glm::normalize(glm::vec3(1.0F, 1.0F, 0.0F)), 0.005F);
    sea.frame.sun_radiance = {1.0F, 1.0F, 1.0F, 0.0F};
    const std::vector<double> calm = greens(sea.between({0.5F, 0.0F}, {3.5F, 0.0F}));
    sea.wave_length_m = 0.05F;
    const std::vector<double> rough = greens(sea.between({0.5F, 0.0F}, {3.5F, 0.0F}));
    const auto peak = std::ranges::max_element(calm) - calm.begin();
    CHECK(std::abs(peak - SeaProbe::places / 2) <= 2); // where the sun is mirrored
    CHECK(std::ranges::max(rough) < 0.5 * std::ranges::max(calm));
    CHECK(std::ranges::max(rough) > 0.01 * std::ranges::max(calm));
    CHECK(rough[8] > 2.0 * calm[8]);
    CHECK(rough[56] > 2.0 * calm[56]);
}

TEST_CASE("sea: a lamp lights the sea as a sun of the same irradiance does") {
    if (!test::have_context()) {
        return;
    }
    SeaProbe by_lamp({"POINT_LIGHTS 1"}), by_sun;
    darken(by_lamp);
    darken(by_sun);
    by_lamp.deep = by_lamp.shallow = by_sun.deep = by_sun.shallow = {0.2F, 0.5F, 0.9F};
    by_lamp.frame.eye.y = by_sun.frame.eye.y = 2.0F;
    const glm::vec3 direction = glm::normalize(glm::vec3(1.0F, 1.0F, 0.0F));
    const glm::vec3 irradiance{3.0F, 2.0F, 1.0F};
    constexpr float away_m = 5000.0F;
    by_sun.frame.sun_direction = glm::vec4(direction, 0.005F);
    by_sun.frame.sun_radiance = glm::vec4(irradiance, 0.0F);
    by_lamp.lamps = {{direction * away_m, irradiance * (away_m * away_m)}};
    for (const float x : {0.3F, 1.5F, 2.0F, 2.5F, 6.0F}) { // in the glitter at 2 m, and beside it
        const glm::dvec4 lamp = by_lamp.at({x, 0.0F}), sun = by_sun.at({x, 0.0F});
        for (int i = 0; i < 3; ++i) {
            CHECK(lamp[i] == test::within(sun[i], 0.04));
        }
    }
    const glm::dvec4 one = by_lamp.at({0.3F, 0.0F});
    by_lamp.lamps.push_back(by_lamp.lamps[0]);
    CHECK(by_lamp.at({0.3F, 0.0F}).g == test::within(2.0 * one.g, 1e-3));
}

TEST_CASE("sea: in the shade it does not glitter, and has a third of the sun's light inside") {
    if (!test::have_context()) {
        return;
    }
    SeaProbe sea;
    darken(sea);
    sea.frame.eye.y = 2.0F;
    sea.frame.sun_direction = glm::vec4(glm::normalize(glm::vec3(1.0F, 1.0F, 0.0F)), 0.005F);
    sea.frame.sun_radiance = {1.0F, 1.0F, 1.0F, 0.0F};
    sea.smoothness = 0.5F;
    const double glitter = sea.at({2.0F, 0.0F}).g;
    sea.specular = 0.75F; // its f0 is 0.015, and below 0.02 reflectance fades out
    CHECK(sea.at({2.0F, 0.0F}).g == test::within(0.75 * 0.84375 * glitter, 0.15));
    sea.specular = 1.0F;
    sea.in_shade = true;
    CHECK(sea.at({2.0F, 0.0F}).g == 0.0);
    SeaProbe milky;
    darken(milky);
    milky.deep = milky.shallow = glm::vec3(1.0F);
    milky.frame.sun_radiance = {1.0F, 1.0F, 1.0F, 0.0F};
    const double lit = milky.at({3.0F, 0.0F}).g; // beside the glitter
    milky.in_shade = true;
    CHECK(milky.at({3.0F, 0.0F}).g == test::within(0.35 * lit, 0.02));
}

TEST_CASE(
    "sea: shallow water has its own colour, and with the square of its depth ever more of the deep one's") {
    if (!test::have_context()) {
        return;
    }
    SeaProbe sea;
    darken(sea);
    sea.frame.water = {0.5F, 0.5F, 0.5F, 0.0F};
    sea.frame.ambient = glm::vec4(1.0F);
    sea.has_refraction = true;
    sea.shallow = {1.0F, 0.0F, 0.0F};
    sea.deep = {0.0F, 1.0F, 0.0F};
    for (const double depth_m : {0.5, 1.0, 3.0}) {
        sea.refraction = test::one_color(0.0F, 0.0F, 0.0F, static_cast<float>(1.0 / (1.0 + depth_m)));
        const glm::dvec4 seen = sea.at({0.01F, 0.0F});
        CHECK(seen.g / (seen.r + seen.g) == test::within(1.0 - std::exp(-0.25 * depth_m * depth_m), 0.02));
    }
}

TEST_CASE("sea: waves move what it mirrors and what lies below, to the side and ahead of the eye") {
    if (!test::have_context()) {
        return;
    }
    const auto picture = [](const std::function<float(float)> &alpha) { // says where it was looked up
        std::vector<float> pixels;
        for (int row = 0; row < SeaProbe::places; ++row) {
            for (int column = 0; column < SeaProbe::places; ++column) {
                const float u = (static_cast<float>(column) + 0.5F) / SeaProbe::places;
                const float v = (static_cast<float>(row) + 0.5F) / SeaProbe::places;
                pixels.insert(pixels.end(), {u, v, 1.0F, alpha(u)});
            }
        }
        return test::float_texture(SeaProbe::places, SeaProbe::places, pixels);
    };
    SeaProbe sea;
    darken(sea);
    // The eye looks along +X: +Z is to its right.
    sea.frame.view[0] = {0.0F, 0.0F, -1.0F, 0.0F};
    sea.frame.view[2] = {1.0F, 0.0F, 0.0F, 0.0F};
    const auto moved = [&](const glm::vec2 &shake) { // du, dv of the middle of the lowest row
        const auto middle = [&] {
            const glm::dvec4 seen = sea.between({1.0F, 0.0F}, {1.0F, 0.0F})[SeaProbe::places / 2];
            return glm::dvec2(seen.x, seen.y) / seen.z;
        };
        sea.shake = shake;
        const glm::dvec2 there = middle();
        sea.shake = {0.0F, 0.0F};
        return glm::vec2(there - middle());
    };
    const auto is = [](const glm::vec2 &found, double u, double v) {
        return std::abs(static_cast<double>(found.x) - u) < 1e-3 &&
               std::abs(static_cast<double>(found.y) - v) < 1e-3;
    };
    sea.has_reflection = true;
    sea.reflection = picture([](float) { return 1.0F; });
    const double aside = 0.25 + 0.75 * std::sqrt(0.5);
    const double rim = 0.5 / SeaProbe::places;        // the lowest row lies on the rim of what is looked up
    CHECK(is(moved({0.0F, 0.5F}), 0.1 * aside, 0.0)); // two layers of 0.5
    CHECK(is(moved({0.5F, 0.0F}), 0.0, 0.1 - rim));
    sea.has_reflection = false;
    sea.has_refraction = true;
    const auto deep_m = [](float metres) { return 1.0F / (1.0F + metres); };
    const double share = 1.0 / (1.0 + 0.03 * std::sqrt(2.0)); // less far away
    sea.refraction = picture([&](float) { return deep_m(2.0F); });
    CHECK(is(moved({0.0F, 0.5F}), 0.1 * aside * share, 0.0));
    CHECK(is(moved({-0.5F, 0.0F}), 0.0, 0.1 * share - rim));
    sea.refraction = picture([&](float) { return deep_m(0.5F); }); // and in shallow water
    CHECK(is(moved({0.0F, 0.5F}), 0.4 * 0.1 * aside * share, 0.0));
    // Beside the floor nothing was drawn: it is not looked up there.
    sea.refraction = picture([&](float u) { return u < 0.54F ? deep_m(2.0F) : 0.0F; });
    CHECK(is(moved({0.0F, 0.5F}), 0.0, -rim));
}

TEST_CASE("sea: in the light from all around it scatters what its colour leaves") {
    if (!test::have_context()) {
        return;
    }
    SeaProbe sea;
    darken(sea);
    sea.deep = sea.shallow = {0.2F, 0.5F, 0.9F};
    sea.frame.ambient = {1.0F, 1.0F, 1.0F, 1.0F};
    const glm::dvec4 seen = sea.at({0.01F, 0.0F}); // straight down
    for (int i = 0; i < 3; ++i) {
        CHECK(seen[i] == test::within(0.98 * static_cast<double>(sea.deep[i]), 0.002));
    }
    // The sun straight above with an irradiance of pi gives as much.
    sea.frame.ambient = glm::vec4(0.0F);
    sea.frame.sun_direction = {0.0F, 1.0F, 0.0F, 0.005F};
    sea.frame.sun_radiance = {M_PI, M_PI, M_PI, 0.0F};
    const glm::dvec4 by_sun = sea.at({3.0F, 0.0F}); // beside the glitter
    sea.frame.sun_radiance = glm::vec4(0.0F);
    sea.frame.ambient = {1.0F, 1.0F, 1.0F, 1.0F};
    const glm::dvec4 by_sky = sea.at({3.0F, 0.0F});
    CHECK(by_sun.g == test::within(by_sky.g, 0.01));
}

TEST_CASE("sea: by day the crests that lean towards the sun let its light through") {
    if (!test::have_context()) {
        return;
    }
    SeaProbe sea;
    darken(sea);
    sea.deep = sea.shallow = glm::vec3(0.5F);
    sea.frame.ambient = glm::vec4(1.0F);
    sea.frame.sun_direction = glm::vec4(glm::normalize(glm::vec3(1.0F, 0.5F, 0.0F)), 0.005F);
    const auto leaning = [&](float lean,
                             float daylight) { // seen from above, where a tilt hardly changes reflection
        sea.lean = {lean, 0.0F};
        sea.frame.daylight.y = daylight;
        return sea.at({0.01F, 0.0F}).g;
    };
    CHECK(leaning(0.05F, 1.0F) > 1.05 * leaning(0.0F, 1.0F));
    CHECK(leaning(0.05F, 1.0F) < 1.31 * leaning(0.0F, 1.0F));
    CHECK(leaning(-0.05F, 1.0F) < 0.95 * leaning(0.0F, 1.0F));
    CHECK(leaning(0.05F, 0.0F) == test::within(leaning(0.0F, 0.0F), 0.01));
}

TEST_CASE("sea: a wide lamp glitters wider and dimmer than a small one") {
    if (!test::have_context()) {
        return;
    }
    SeaProbe sea({"POINT_LIGHTS 1"});
    darken(sea);
    const auto glitter_of = [&](float radius_m) { // the lamp is mirrored at 2 m
        sea.lamps = {{{4.0F, 1.0F, 0.0F}, glm::vec3(1.0F), radius_m}};
        return greens(sea.between({1.0F, 0.0F}, {3.0F, 0.0F}));
    };
    const std::vector<double> small = glitter_of(0.01F), wide = glitter_of(0.5F);
    CHECK(std::ranges::max(wide) < 0.3 * std::ranges::max(small));
    CHECK(std::ranges::max(wide) > 0.02 * std::ranges::max(small));
    CHECK(wide[8] > 3.0 * small[8]);
    CHECK(wide[56] > 3.0 * small[56]);
}

TEST_CASE("sea: it is clear where the sand comes out of it, and hides nothing behind it in half a metre") {
    if (!test::have_context()) {
        return;
    }
    SeaProbe sea;
    sea.has_refraction = true;
    const auto opacity = [&](double depth_m) {
        sea.refraction = test::one_color(0.0F, 0.0F, 0.0F, static_cast<float>(1.0 / (1.0 + depth_m)));
        const auto line = sea.between({1.0F, 0.0F}, {60.0F, 0.0F});
        double sum = 0.0;
        for (const glm::dvec4 &color : line) {
            sum += color.a / SeaProbe::places;
        }
        return sum;
    };
    CHECK(opacity(0.0) == 0.0);
    CHECK(opacity(0.02) > 0.0);
    double before = 0.0;
    for (const double depth_m : {0.02, 0.03, 0.04, 0.05}) {
        const double now = opacity(depth_m);
        CHECK(now > before);
        CHECK(now < 1.0);
        before = now;
    }
    CHECK(opacity(0.1) == 1.0);
    CHECK(opacity(5.0) == 1.0);
}

TEST_CASE("sea: it ends at its border, wherever the floating origin lies") {
    if (!test::have_context()) {
        return;
    }
    test::ShaderProbe corner(1, "water.vert",
                             "in vec3 v_position;\nout vec4 color;\n"
                             "void main() { color = vec4(v_position, 1.0); }\n");
    const auto seen_at = [&](const glm::vec2 &center, const glm::vec2 &vertex, const glm::vec3 &anchor) {
        gl::FrameUniforms frame = test::plain_frame(1);
        frame.view_projection = glm::mat4(0.0F);
        frame.view_projection[3][3] = 1.0F; // all points into the one pixel
        frame.anchor = glm::vec4(anchor, 0.0F);
        frame.water.w = 2.5F;
        corner.set_frame(frame);
        corner.set("u_half_size_m", {300.0F});
        corner.set("u_center", {center.x - anchor.x, center.y - anchor.z});
        glVertexAttrib3f(0, vertex.x, 7.0F, vertex.y);
        const std::vector<float> pixel = corner.draw(GL_POINTS, 0, 1);
        return glm::vec3(pixel[0] + anchor.x, pixel[1], pixel[2] + anchor.z);
    };
    for (const glm::vec3 &anchor : {glm::vec3(0.0F), glm::vec3(256.0F, 0.0F, -64.0F)}) {
        CHECK(seen_at({100.0F, -50.0F}, {20.0F, 30.0F}, anchor) == glm::vec3(120.0F, 2.5F, -20.0F));
        CHECK(seen_at({100.0F, -50.0F}, {500.0F, -400.0F}, anchor) == glm::vec3(300.0F, 2.5F, -300.0F));
        CHECK(seen_at({100.0F, -50.0F}, {-500.0F, 400.0F}, anchor) == glm::vec3(-300.0F, 2.5F, 300.0F));
    }
}
