#include "context.hpp"
#include "gl/texture.hpp"
#include "shader_probe.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>
#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <vector>

using namespace paradize;

namespace {

constexpr int air_px = 32;

/// A picture of air_px squared pixels, two floats for each place.
gl::Texture air_picture(const std::function<glm::vec2(int, int)> &value) {
    std::vector<float> pixels;
    for (int row = 0; row < air_px; ++row) {
        for (int column = 0; column < air_px; ++column) {
            const glm::vec2 one = value(column, row);
            pixels.insert(pixels.end(), {one.x, one.y, 0.0F, 1.0F});
        }
    }
    return test::float_texture(air_px, air_px, pixels);
}

/// The share of the light that the air along a ray scatters to the eye, as the march finds it.
class Air {
  public:
    float density = 0.002F, range_m = 400.0F, anisotropy = 0.6F;
    float window_depth = 1.0F;
    bool lit = true;
    float lit_to_m = 1e9F;      // what lies farther along the ray is in the shade, if `lit`
    float square_ends_m = 1e9F; // of the map, along the ray
    float fov_rad = 0.02F;
    std::size_t corner_px = 16; // of the square that is looked at

    /// angle: of the ray to the sun.
    glm::dvec2 towards(double angle_rad) { // share; depth, of the range
        const gl::Texture map = gl::make_depth_comparison_layers(1, 1);
        const float depth = lit ? 0.5F : 0.0F;
        glBindTexture(GL_TEXTURE_2D_ARRAY, map.name());
        glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, 1, 1, 1, GL_DEPTH_COMPONENT, GL_FLOAT, &depth);
        std::vector<float> depths(std::size_t{4} * air_px * air_px, window_depth);
        const gl::Texture seen = test::float_texture(air_px, air_px, depths);
        gl::FrameUniforms frame = test::plain_frame(air_px);
        const glm::vec3 eye(0.0F, 1.0F, 0.0F), ahead(1.0F, 0.0F, 0.0F);
        frame.view_projection = glm::perspective(fov_rad, 1.0F, 0.5F, 1000.0F) *
                                glm::lookAt(eye, eye + ahead, glm::vec3(0.0F, 1.0F, 0.0F));
        frame.inverse_view_projection = glm::inverse(frame.view_projection);
        frame.shadow_from_world = glm::mat4(0.0F);
        frame.shadow_from_world[0] = {0.5F / square_ends_m, 0.0F, 0.5F / lit_to_m, 0.0F};
        frame.shadow_from_world[3] = {0.5F, 0.5F, lit ? 0.0F : 0.5F, 1.0F};
        frame.sun_direction = {static_cast<float>(std::cos(angle_rad)), 0.0F,
                               static_cast<float>(std::sin(angle_rad)), 0.005F};
        probe_.set_frame(frame);
        probe_.set_texture("u_depth", 0, GL_TEXTURE_2D, seen);
        probe_.set_texture("u_shadow_map", 1, GL_TEXTURE_2D_ARRAY, map);
        probe_.set_int("u_downsample", 1);
        probe_.set("u_density", {density});
        probe_.set("u_anisotropy", {anisotropy});
        probe_.set("u_range_m", {range_m});
        const std::vector<float> pixels = probe_.draw();
        double sum = 0.0;
        for (std::size_t y = 0; y < 4; ++y) { // a square of all places of the march
            for (std::size_t x = 0; x < 4; ++x) {
                sum += pixels[4 * ((y + corner_px) * air_px + x + corner_px)] / 16.0;
            }
        }
        return {sum, pixels[4 * (corner_px * air_px + corner_px) + 1]};
    }

  private:
    test::ShaderProbe probe_{air_px, "fullscreen.vert", "shafts_march.frag"};
};

/// shafts_smooth.frag over a picture of shares and depths.
std::vector<float> smoothed(const std::function<glm::vec2(int, int)> &value) {
    test::ShaderProbe probe(air_px, "fullscreen.vert", "shafts_smooth.frag");
    const gl::Texture shafts = air_picture(value);
    probe.set_texture("u_shafts", 0, GL_TEXTURE_2D, shafts);
    return probe.draw();
}

/// shafts_add.frag: adds a picture of shares to a grey picture, with the depth of each of its pixels, of the
/// range. texels: of the shares per pixel.
std::vector<float> added(const std::function<glm::vec2(int, int)> &value, float texels = 1.0F) {
    test::ShaderProbe probe(air_px, "fullscreen.vert", "shafts_add.frag");
    const gl::Texture shafts = air_picture(value);
    std::vector<float> pixels;
    for (int i = 0; i < air_px * air_px; ++i) {
        pixels.insert(pixels.end(), {0.5F, 0.5F, 0.5F, 0.7F});
    }
    const gl::Texture grey = test::float_texture(air_px, air_px, pixels);
    const auto texel = [&](int pixel) {
        return static_cast<int>(texels * (static_cast<float>(pixel) + 0.5F));
    };
    const gl::Texture depth = air_picture([&](int x, int y) {
        const double metres = std::max(100.0 * static_cast<double>(value(texel(x), texel(y)).y), 0.5);
        return glm::vec2(static_cast<float>(1000.0 * (metres - 0.5) / (metres * 999.5)),
                         0.0F); // near 0.5, far 1000
    });
    probe.set_frame(test::plain_frame(air_px));
    probe.set_texture("u_picture", 0, GL_TEXTURE_2D, grey);
    probe.set_texture("u_depth", 1, GL_TEXTURE_2D, depth);
    probe.set_texture("u_shafts", 2, GL_TEXTURE_2D, shafts);
    probe.set("u_texels", {texels});
    probe.set("u_range_m", {100.0F});
    probe.set("u_light_radiance", {2.0F, 1.0F, 0.5F});
    return probe.draw();
}

} // namespace

TEST_CASE("shafts: lit air is bright towards the sun and as it was elsewhere, shaded air is darker") {
    if (!test::have_context()) {
        return;
    }
    Air air;
    const double towards = air.towards(0.05).x;
    CHECK(towards > 0.1);
    CHECK(std::abs(air.towards(1.2).x) < 0.03 * towards);
    CHECK(std::abs(air.towards(2.5).x) < 0.03 * towards);
    double before = towards;
    for (double angle = 0.1; angle < 1.5; angle += 0.1) {
        CHECK(air.towards(angle).x < before);
        before = air.towards(angle).x;
    }
    air.lit = false;
    for (const double angle : {0.05, 1.2}) {
        CHECK(air.towards(angle).x < 0.0);
    }
    // In the shade all is missing that the air there scatters, which the sky holds at large angles.
    const double forward = (1.0 - 0.36) / (4.0 * M_PI * std::pow(1.36 - 1.2 * std::cos(1.2), 1.5));
    CHECK(air.towards(1.2).x == test::within(-forward * (1.0 - std::exp(-0.002 * 400.0)), 0.1));
}

TEST_CASE("shafts: the air counts as far as something stands in it, and no farther than its range") {
    if (!test::have_context()) {
        return;
    }
    Air air;
    const auto depth_of = [](double metres) { // near 0.5, far 1000
        return static_cast<float>(1000.0 * (metres - 0.5) / (metres * 999.5));
    };
    air.density = 1e-4F; // thin: light adds up with the way
    const double whole = air.towards(0.05).x;
    CHECK(air.towards(0.05).y == 1.0);
    air.window_depth = depth_of(100.0);
    CHECK(air.towards(0.05).x == test::within(0.25 * whole, 0.03));
    CHECK(air.towards(0.05).y == test::within(0.25, 0.01));
    air.window_depth = depth_of(600.0);
    CHECK(air.towards(0.05).x == test::within(whole, 0.01));
    air.density = 0.0F;
    CHECK(air.towards(0.05).x == 0.0);
}

TEST_CASE(
    "shafts: of a ray that enters the shade or leaves the map the lit part counts, and all of its length") {
    if (!test::have_context()) {
        return;
    }
    Air air;
    air.density = 1e-4F;
    const double all = air.towards(0.05).x;
    air.lit = false;
    const double none = air.towards(0.05).x;
    const auto lit_share = [&] { return (air.towards(0.05).x - none) / (all - none); };
    air.square_ends_m = 100.0F; // beside the map all is lit
    CHECK(lit_share() == doctest::Approx(0.75).epsilon(0.01));
    air.square_ends_m = 1e9F;
    air.lit = true;
    for (const double half_steps : {7.0, 13.0}) { // sixteen places of the march share each step evenly
        air.lit_to_m = static_cast<float>(400.0 * half_steps / 24.0);
        CHECK(lit_share() == doctest::Approx(half_steps / 24.0).epsilon(0.01));
    }
    air.lit = false;
    air.anisotropy = 0.0F; // as much in all directions
    air.window_depth = static_cast<float>(1000.0 * (100.0 - 0.5) / (100.0 * 999.5));
    const double straight = air.towards(0.05).x;
    air.fov_rad = 1.5F;
    air.corner_px = 0;
    const double aside = std::tan(0.75) * 14.0 / 16.0; // of the square's middle, along both axes
    CHECK(air.towards(0.05).x == test::within(straight * std::sqrt(1.0 + 2.0 * aside * aside), 0.02));
}

TEST_CASE("shafts: their dither is smoothed away, and no light leaks over an edge of depth") {
    if (!test::have_context()) {
        return;
    }
    const auto dithered = smoothed([](int x, int y) { return glm::vec2(x % 4 + 4 * (y % 4), 0.5F); });
    for (std::size_t y = 4; y < air_px - 4; ++y) {
        for (std::size_t x = 4; x < air_px - 4; ++x) {
            CHECK(dithered[4 * (y * air_px + x)] == test::within(7.5, 1e-4));
        }
    }
    const auto diagonal =
        smoothed([](int x, int y) { return glm::vec2(x % 4 == y % 4 ? 16.0F : 0.0F, 0.5F); });
    CHECK(diagonal[4 * (16 * air_px + 16)] == test::within(4.0, 1e-4));
    CHECK(diagonal[4 * (16 * air_px + 17)] == test::within(4.0, 1e-4));
    const auto edge = [](int x, int) { return x < 16 ? glm::vec2(1.0F, 0.1F) : glm::vec2(0.0F, 0.9F); };
    const std::vector<float> pixels = smoothed(edge);
    CHECK(pixels[4 * (16 * air_px + 15)] > 0.95F);
    CHECK(pixels[4 * (16 * air_px + 16)] < 0.05F);
    CHECK(pixels[4 * (16 * air_px + 16) + 1] == 0.9F);
}

TEST_CASE("shafts: they are added in the light's colour, by depth, and shade leaves some of the picture") {
    if (!test::have_context()) {
        return;
    }
    const auto lit = added([](int, int) { return glm::vec2(0.1F, 0.5F); });
    const float *middle = &lit[std::size_t{4} * (16 * air_px + 16)];
    CHECK(middle[0] == doctest::Approx(0.5 + 0.2));
    CHECK(middle[1] == doctest::Approx(0.5 + 0.1));
    CHECK(middle[2] == doctest::Approx(0.5 + 0.05));
    CHECK(middle[3] == 0.7F);
    const auto dark = added([](int, int) { return glm::vec2(-10.0F, 0.5F); });
    CHECK(dark[std::size_t{4} * (16 * air_px + 16)] > 0.1F);
    CHECK(dark[std::size_t{4} * (16 * air_px + 16)] < 0.25F);
    // Near things before lit air far behind them: the light ends at their edge, though a texel lies on both
    // sides.
    const auto edge =
        added([](int x, int) { return x < 4 ? glm::vec2(0.0F, 0.1F) : glm::vec2(1.0F, 0.9F); }, 0.25F);
    const auto green = [&](std::size_t x) { return edge[4 * (16 * air_px + x) + 1] - 0.5F; };
    CHECK(green(14) < 0.03F);
    CHECK(green(15) < 0.5F);
    CHECK(green(16) > 0.5F);
    CHECK(green(17) > 0.97F);
    const auto turned =
        added([](int, int y) { return y < 4 ? glm::vec2(0.0F, 0.1F) : glm::vec2(1.0F, 0.9F); }, 0.25F);
    for (std::size_t y = 13; y < 19; ++y) {
        CHECK(turned[4 * (y * air_px + 16) + 1] - 0.5F == doctest::Approx(green(y)));
    }
}
