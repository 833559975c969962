#include "context.hpp"
#include "shader_probe.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

using namespace paradize;

namespace {

constexpr int sparkle_px = 96;

/// A particle straight ahead, with the pixels of a camera at its distance.
class Sparkle {
  public:
    float size_m = 0.2F, rotation_rad = 0.0F, opacity = 1.0F;
    bool speck = false;
    double pixels_per_rad = 200.0;

    /// Green and alpha of each pixel.
    std::vector<glm::dvec2> at(double distance_m) {
        gl::FrameUniforms frame = test::plain_frame(sparkle_px);
        frame.eye = {0.0F, 0.0F, 0.0F, 1.0F};
        frame.lens.z = static_cast<float>(pixels_per_rad);
        const double half_m = 0.5 * sparkle_px * distance_m / pixels_per_rad; // that the picture shows there
        frame.view_projection = glm::mat4(1.0F);
        frame.view_projection[0][0] = frame.view_projection[1][1] = static_cast<float>(1.0 / half_m);
        frame.view_projection[2][2] = 0.0F;
        probe_.set_frame(frame);
        probe_.set("u_clip_plane", {0.0F, 0.0F, 0.0F, 1.0F});
        probe_.set("u_speck", {speck ? 1.0F : 0.0F});
        probe_.set("u_water_glow", {0.0F, 0.0F, 0.0F});
        probe_.set("u_water_scatter", {0.0F});
        glVertexAttrib4f(7, 0.0F, 0.0F, static_cast<float>(-distance_m), size_m);
        glVertexAttrib2f(8, rotation_rad, opacity);
        glVertexAttrib3f(9, 0.5F, 1.0F, 0.5F);
        const std::vector<float> pixels = probe_.draw(GL_TRIANGLE_STRIP, 0, 4);
        std::vector<glm::dvec2> out;
        for (std::size_t i = 0; i < pixels.size(); i += 4) {
            out.emplace_back(pixels[i + 1], pixels[i + 3]);
        }
        return out;
    }

  private:
    test::ShaderProbe probe_{sparkle_px, "particle.vert", "particle.frag"};
};

double light_of(const std::vector<glm::dvec2> &pixels) {
    double sum = 0.0;
    for (const glm::dvec2 &pixel : pixels) {
        sum += pixel.x;
    }
    return sum;
}

/// The largest distance of a lit pixel from the middle, px.
double radius_px(const std::vector<glm::dvec2> &pixels) {
    double most = 0.0;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        const double x = static_cast<double>(i % sparkle_px) - 47.5,
                     y = static_cast<double>(i / sparkle_px) - 47.5;
        most = pixels[i].x > 1e-4 ? std::max(most, std::hypot(x, y)) : most;
    }
    return most;
}

} // namespace

TEST_CASE("sparkle: it is as wide as its size, its light ends inside, and its rays turn with it") {
    if (!test::have_context()) {
        return;
    }
    Sparkle sparkle;
    for (const float rotation : {0.0F, 0.6F}) {
        sparkle.rotation_rad = rotation;
        const auto pixels = sparkle.at(0.5); // 80 pixels wide
        CHECK(radius_px(pixels) > 30.0);
        CHECK(radius_px(pixels) < 40.5);
        const auto on_circle = [&](double angle) { // 20 pixels from the middle
            const auto x = static_cast<std::size_t>(48.0 + 20.0 * std::cos(angle)),
                       y = static_cast<std::size_t>(48.0 + 20.0 * std::sin(angle));
            return pixels[y * sparkle_px + x].x;
        };
        const auto turn = static_cast<double>(rotation);
        for (int ray = 0; ray < 4; ++ray) {
            CHECK(on_circle(turn + 0.5 * M_PI * ray) > 1.5 * on_circle(turn + 0.5 * M_PI * (ray + 0.5)));
        }
        CHECK(pixels[48 * sparkle_px + 48].x > 1.0);  // a bright core
        CHECK(pixels[48 * sparkle_px + 48].y == 0.0); // it adds light
    }
    sparkle.opacity = 0.5F;
    const double half = light_of(sparkle.at(0.5));
    sparkle.opacity = 1.0F;
    CHECK(light_of(sparkle.at(0.5)) == doctest::Approx(2.0 * half));
}

TEST_CASE(
    "sparkle: far away it is dimmer instead of smaller than some pixels, and nothing jumps on the way") {
    if (!test::have_context()) {
        return;
    }
    Sparkle sparkle;
    for (const bool speck : {false, true}) {
        sparkle.speck = speck;
        double before = light_of(sparkle.at(2.0));
        for (double distance_m = 2.2; distance_m < 60.0; distance_m *= 1.1) {
            const auto pixels = sparkle.at(distance_m);
            const double now = light_of(pixels);
            CHECK(now < 1.03 * before);
            CHECK(now > 0.65 * before); // light of a point falls by 0.83; pixels miss some of a core
            CHECK(radius_px(pixels) > (speck ? 0.5 : 2.0));
            before = now;
        }
        CHECK(before > 0.0);
        const double still_wide_m = speck ? 20.0 : 6.0;
        CHECK(light_of(sparkle.at(60.0)) < 0.3 * light_of(sparkle.at(still_wide_m)));
        CHECK(radius_px(sparkle.at(60.0)) < (speck ? 2.0 : 5.0));
    }
}

TEST_CASE("sparkle: a speck covers what is behind it in its middle, and its edge is soft") {
    if (!test::have_context()) {
        return;
    }
    Sparkle speck;
    speck.speck = true;
    const auto pixels = speck.at(0.5);
    CHECK(pixels[48 * sparkle_px + 48].y == 1.0);
    CHECK(pixels[48 * sparkle_px + 48].x == doctest::Approx(1.0));
    for (std::size_t i = 49; i < sparkle_px; ++i) {
        const glm::dvec2 &here = pixels[48 * sparkle_px + i], &before = pixels[48 * sparkle_px + i - 1];
        CHECK(here.y <= before.y);
        CHECK(before.y - here.y < 0.1);
        CHECK(here.x == doctest::Approx(here.y)); // its colour by its cover
    }
    CHECK(pixels[48 * sparkle_px + 95].y == 0.0);
}
