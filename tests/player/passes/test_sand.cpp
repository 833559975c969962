#include "context.hpp"
#include "gl/frame_uniforms.hpp"
#include "gl/texture.hpp"
#include "shader_probe.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

using namespace paradize;

namespace {

constexpr int places = 64;

const std::string line_vertex =
    "#include \"lib/fullscreen.glsl\"\n"
    "uniform vec3 u_first;\nuniform vec3 u_last;\nuniform vec4 u_border;\n"
    "out vec3 v_position;\nout vec3 v_normal;\nout vec4 v_tangent;\nout vec2 v_uv_sand;\nout vec2 "
    "v_uv_effect;\n"
    "flat out vec3 v_zenith;\nflat out vec3 v_sand_mean;\n"
    "void main() {\nvec2 corner = fullscreen_corner(gl_VertexID);\nfloat at = 0.5 + 0.5 * corner.x;\n"
    "v_position = mix(u_first, u_last, at);\nv_normal = vec3(0.0, 1.0, 0.0);\nv_tangent = vec4(1.0, 0.0, "
    "0.0, 1.0);\n"
    "v_uv_sand = v_position.xz;\nv_uv_effect = mix(u_border.xy, u_border.zw, at);\nv_zenith = vec3(1.0);\n"
    "v_sand_mean = vec3(0.5);\ngl_Position = vec4(corner, 0.0, 1.0); }\n";

/// Level sand along a line, in white light from all around. Water of no colour lies at y = 0.
class Sand {
  public:
    explicit Sand(std::initializer_list<std::string_view> defines)
        : probe_(places, line_vertex, "terrain.frag", defines) {}

    glm::vec3 color{0.5F};
    glm::vec3 wet{1.0F, 0.4F, 0.9F}; // up to which height, m; how much darker; smoothness
    glm::vec4 swash{0.0F, 0.0F, 0.0F, 1.0F};
    glm::vec4 mix{-1e6F, -1e6F, 0.0F, 0.0F}; // heights of no sand and of sand alone, m; specular, smoothness
    glm::vec4 border{0.5F};                  // coordinates of the whole terrain at both ends
    glm::vec3 mirrored{0.0F};
    bool refracting = false;
    glm::vec3 eye{0.0F, 100.0F, 0.0F};

    /// Radiance, and the last channel, at the middle of equal parts of the line.
    std::vector<glm::dvec4> between(const glm::vec3 &first, const glm::vec3 &last) {
        gl::FrameUniforms frame = test::plain_frame(places);
        frame.eye = glm::vec4(eye, 1.0F);
        frame.ambient = glm::vec4(1.0F);
        frame.water.w = 0.0F;
        probe_.set_frame(frame);
        const gl::Program &program = probe_.use();
        const std::array<float, 12> rows{0.1F, 0, 0, 0.1F, 0.1F, 0, 0, 0.1F, 0.1F, 0, 0, 0.1F};
        const std::array<float, 6> offsets{};
        glUniform4fv(program.location("u_wave_rows"), 3, rows.data());
        glUniform2fv(program.location("u_wave_offsets"), 3, offsets.data());
        const gl::Texture sand = test::one_color(color.r, color.g, color.b, 1.0F),
                          picture = test::one_color(mirrored.r, mirrored.g, mirrored.b, 1.0F);
        probe_.set_texture("u_sand_color", 0, GL_TEXTURE_2D, sand);
        probe_.set_texture("u_reflection", 1, GL_TEXTURE_2D, picture);
        probe_.set_texture("u_wave_normal", 2, GL_TEXTURE_2D, calm_);
        probe_.set_texture("u_effect_color", 1, GL_TEXTURE_2D, picture);
        probe_.set_texture("u_effect_normal", 2, GL_TEXTURE_2D, calm_);
        probe_.set_texture("u_sand_normal", 2, GL_TEXTURE_2D, calm_);
        probe_.set("u_grain_offset_uv", {0.0F, 0.0F});
        probe_.set_texture("u_sky", 3, GL_TEXTURE_CUBE_MAP, sky_);
        probe_.set_texture("u_shadow_map", 4, GL_TEXTURE_2D_ARRAY, no_shadow_);
        probe_.set("u_sky_blur", {-1.0F}); // no sky: `ambient` comes from everywhere
        for (const char *off : {"u_sky_trimmed_mips", "u_shadow_texel", "u_shadow_penumbra_m",
                                "u_shadow_blur_m", "u_caustics", "u_water_scatter"}) {
            probe_.set(off, {0.0F});
        }
        probe_.set("u_water_glow", {0.0F, 0.0F, 0.0F});
        probe_.set("u_has_reflection", {mirrored == glm::vec3(0.0F) ? 0.0F : 1.0F});
        probe_.set("u_sand_reference_m", {1.0F}); // far away: grains have no contrast of their own
        probe_.set("u_sand_mix", {mix.x, mix.y, mix.z, mix.w});
        probe_.set("u_wet", {wet.x, wet.y, wet.z});
        probe_.set("u_swash", {swash.x, swash.y, swash.z, swash.w});
        probe_.set("u_refracting", {refracting ? 1.0F : 0.0F});
        probe_.set("u_sun_refracted", {0.0F, 1.0F, 0.0F});
        probe_.set("u_shadow_cascades", {1.0F, 0.0F, 0.0F, 1.0F});
        probe_.set("u_border", {border.x, border.y, border.z, border.w});
        probe_.set("u_first", {first.x, first.y, first.z});
        probe_.set("u_last", {last.x, last.y, last.z});
        const std::vector<float> pixels = probe_.draw();
        std::vector<glm::dvec4> out;
        for (std::size_t i = 0; i < std::size_t{4} * places; i += 4) {
            out.emplace_back(pixels[i], pixels[i + 1], pixels[i + 2], pixels[i + 3]);
        }
        return out;
    }
    /// The share of a sand's colour that is seen: what the surface mirrors drops out of a difference.
    std::vector<glm::dvec3> shown(const glm::vec3 &first, const glm::vec3 &last) {
        color = glm::vec3(0.75F);
        const std::vector<glm::dvec4> light = between(first, last);
        color = glm::vec3(0.25F);
        const std::vector<glm::dvec4> dark = between(first, last);
        std::vector<glm::dvec3> out;
        for (std::size_t i = 0; i < light.size(); ++i) {
            out.push_back(2.0 * glm::dvec3(light[i] - dark[i]));
        }
        return out;
    }

  private:
    test::ShaderProbe probe_;
    gl::Texture calm_ = test::one_color(0, 0, 0, 0), no_shadow_ = gl::make_depth_comparison_layers(1, 1),
                sky_ = test::float_cube(2, [](const glm::vec3 &) { return glm::vec3(1.0F); });
};

constexpr std::string_view no_effect = "EFFECT_MAP 0", no_normal = "SAND_NORMAL 0", waves_run_up = "SWASH 1";

} // namespace

TEST_CASE(
    "sand: its tone changes over metres, by a few hundredths, and is on the whole that of its picture") {
    if (!test::have_context()) {
        return;
    }
    Sand sand({no_effect, no_normal});
    double sum = 0.0, least = 1.0, most = 1.0;
    constexpr int lines = 40;
    for (int line = 0; line < lines; ++line) {
        const auto z = 17.0F * static_cast<float>(line);
        double before = 0.0;
        for (const glm::dvec3 &tone : sand.shown({-50.0F, 10.0F, z}, {50.0F, 10.0F, z})) {
            CHECK(tone.r == doctest::Approx(tone.b)); // of one hue
            CHECK((before == 0.0 || std::abs(tone.g - before) < 0.05));
            before = tone.g;
            sum += tone.g / (lines * places);
            least = std::min(least, tone.g);
            most = std::max(most, tone.g);
        }
    }
    CHECK(sum == test::within(1.0, 0.01));
    CHECK(least > 0.93);
    CHECK(least < 0.97);
    CHECK(most < 1.07);
    CHECK(most > 1.03);
}

TEST_CASE("sand: below the height where it begins, the shader without sand shows what that with sand shows") {
    if (!test::have_context()) {
        return;
    }
    const auto floor = [](std::initializer_list<std::string_view> defines, float low) {
        Sand sand(defines);
        sand.color = {0.7F, 0.5F, 0.3F};
        sand.mirrored = {0.2F, 0.6F, 0.4F}; // the effect map too
        sand.mix = {low, low + 1.0F, 0.0F, 0.0F};
        return sand.between({-20.0F, -4.0F, 0.0F}, {20.0F, -0.5F, 5.0F});
    };
    const auto without = floor({"SUNKEN 1", "MATTE 1", "SAND 0"}, -0.5F);
    CHECK(without == floor({"SUNKEN 1", "MATTE 1"}, -0.5F));
    CHECK(without != floor({"SUNKEN 1", "MATTE 1"}, -2.0F));
}

TEST_CASE(
    "sand: wet sand is darker, most of all in blue, and neither high on the beach nor under water is any") {
    if (!test::have_context()) {
        return;
    }
    Sand sand({no_effect, no_normal});
    const auto darkening = [&](float height) {
        sand.wet.y = 0.0F;
        const glm::dvec3 dry = sand.shown({3.0F, height, 0.0F}, {3.0F, height, 0.0F})[0];
        sand.wet.y = 0.4F;
        return glm::dvec3(1.0) - sand.shown({3.0F, height, 0.0F}, {3.0F, height, 0.0F})[0] / dry;
    };
    for (const float height : {1.5F, 10.0F, -0.2F, -3.0F}) {
        CHECK(glm::length(darkening(height)) < 1e-6);
    }
    const glm::dvec3 wettest = darkening(0.05F);
    CHECK(wettest.g == test::within(0.4, 1e-4));
    CHECK(wettest.r < 0.95 * wettest.g);
    CHECK(wettest.b > 1.05 * wettest.g);
    double before = wettest.g;
    for (float height = 0.1F; height < 1.5F; height += 0.1F) {
        const double here = darkening(height).g;
        CHECK(here < before + 1e-5);
        CHECK(before - here < 0.15); // no edge
        before = here;
    }
    // The sand's edge wanders by less than half of the height up to which it is wet.
    CHECK(darkening(0.2F).g > 0.39);
    CHECK(darkening(1.25F).g < 0.01);
}

TEST_CASE("sand: the refracted floor holds its depth, and ends softly at the border of the terrain") {
    if (!test::have_context()) {
        return;
    }
    Sand sand({no_effect, no_normal});
    sand.refracting = true;
    const glm::vec3 floor(0.0F, -3.0F, 0.0F);
    for (const bool along : {true, false}) {
        sand.border = along ? glm::vec4(0.0F, 0.5F, 1.0F, 0.5F) : glm::vec4(0.5F, 0.0F, 0.5F, 1.0F);
        const std::vector<glm::dvec4> seen = sand.between(floor, floor);
        CHECK(seen[places / 2].a == doctest::Approx(1.0 / (1.0 + 3.0)));
        CHECK(seen[places / 8].a == doctest::Approx(seen[places / 2].a));
        CHECK(seen.front().a < 0.1 * seen[places / 2].a);
        CHECK(seen.front().a > 0.0);
        for (std::size_t i = 0; i < places; ++i) {
            CHECK(seen[i].a == doctest::Approx(seen[places - 1 - i].a)); // the same on both sides
            CHECK((i == 0 || i >= places / 2 || seen[i].a >= seen[i - 1].a));
        }
    }
    sand.refracting = false;
    CHECK(sand.between(floor, floor)[0].a == 1.0);
}

TEST_CASE("sand: where a wave runs there is foam at its edge, white on any sand, darker sand, and a sheet "
          "that mirrors") {
    if (!test::have_context()) {
        return;
    }
    Sand sand({no_effect, no_normal, waves_run_up});
    sand.wet = {0.0F, 0.0F, 0.0F};
    const float run_up_m = 0.5F;
    double most_foam = 0.0, most_mirrored = 0.0, darkest = 1.0, highest_m = 0.0;
    std::size_t with_foam = 0, many = 0;
    for (int moment = 0; moment < 20; ++moment) {
        sand.swash = {run_up_m, static_cast<float>(moment), 0.05F * static_cast<float>(moment), 30.0F};
        const auto z = 3.0F * static_cast<float>(moment);
        const glm::vec3 sea(0.0F, 0.02F, z), land(8.0F, 1.02F, z); // a beach of 1 in 8
        sand.eye = {4.0F, 1.5F, z + 8.0F};
        const std::vector<glm::dvec3> shown = sand.shown(sea, land);
        sand.color = glm::vec3(0.0F);
        const std::vector<glm::dvec4> black = sand.between(sea, land);
        sand.mirrored = {100.0F, 0.0F, 0.0F};
        const std::vector<glm::dvec4> bright = sand.between(sea, land);
        sand.mirrored = glm::vec3(0.0F);
        for (std::size_t i = 0; i < places; ++i) {
            const double along = (static_cast<double>(i) + 0.5) / places, height = 0.02 + along;
            const double foam = black[i].g / 0.85;
            if (height > 1.2 * static_cast<double>(run_up_m)) { // dry
                CHECK(foam == 0.0);
                CHECK(shown[i].g > 0.92);
                CHECK(bright[i].r == black[i].r);
                continue;
            }
            CHECK(foam >= 0.0);
            CHECK(foam <= 1.0);
            ++many;
            with_foam += foam > 0.1 ? 1 : 0;
            most_foam = std::max(most_foam, foam);
            if (foam < 0.5) {
                darkest = std::min(darkest, shown[i].g / (1.0 - foam));
            }
            const glm::dvec3 to_eye(4.0 - 8.0 * along, 1.5 - height, 8.0);
            const double fresnel = 0.02 + 0.98 * std::pow(1.0 - to_eye.y / glm::length(to_eye), 5.0);
            const double share = (bright[i].r - black[i].r) / (100.0 - black[i].r) / fresnel;
            CHECK(share >= 0.0);
            CHECK(share <= 1.0 - foam + 1e-4);
            most_mirrored = std::max(most_mirrored, share);
            highest_m = std::max(highest_m, share > 0.3 ? height : 0.0);
        }
    }
    CHECK(most_foam > 0.5);
    CHECK(with_foam > many / 50);
    CHECK(with_foam < many / 4);
    CHECK(darkest > 0.93 * (1.0 - 0.22)); // the film of water, where the sand's own tone is darkest
    CHECK(darkest < 0.80);
    CHECK(most_mirrored > 0.999);
    CHECK(highest_m > 0.7 * static_cast<double>(run_up_m)); // nothing cuts a wave off
}
