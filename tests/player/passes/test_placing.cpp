#include "context.hpp"
#include "scene/wind.hpp"
#include "shader_probe.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>
#include <glm/ext/matrix_clip_space.hpp>
#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

using namespace paradize;

namespace {

const std::string wind_text =
    "#include \"lib/frame.glsl\"\n#include \"lib/wind.glsl\"\nuniform vec3 u_origin;\n"
    "uniform vec2 u_shares;\nout vec4 color;\nvoid main() {\n"
    "vec3 p = vec3(gl_FragCoord.x, 0.1 * gl_FragCoord.x, gl_FragCoord.y) - u_origin;\n"
    "color = vec4(in_wind(p, u_shares, vec2(0.5, 0.1)) - p, 1.0); }\n";

/// How far wind of a moment moves points near the anchor, one in each pixel. probe: of wind_text.
std::vector<glm::dvec3> moved_by_wind(test::ShaderProbe &probe, const glm::dvec3 &anchor, double second,
                                      const glm::vec2 &shares) {
    assets::Wind wind;
    wind.direction = glm::normalize(glm::vec2(0.8F, -0.6F));
    wind.speed_m_per_s = 5.0F;
    wind.gust_m = 20.0F;
    const WindNow now = wind_now(wind, 240.0, second, anchor);
    gl::FrameUniforms frame = test::plain_frame(16);
    frame.wind = now.direction;
    frame.wind_phases = now.phases;
    probe.set_frame(frame);
    probe.set("u_origin",
              {static_cast<float>(anchor.x), static_cast<float>(anchor.y), static_cast<float>(anchor.z)});
    probe.set("u_shares", {shares.x, shares.y});
    const std::vector<float> pixels = probe.draw();
    std::vector<glm::dvec3> out;
    for (std::size_t i = 0; i < pixels.size(); i += 4) {
        out.emplace_back(pixels[i], pixels[i + 1], pixels[i + 2]);
    }
    return out;
}

const std::string refraction_vertex =
    "#include \"lib/position.glsl\"\nuniform vec3 u_world;\nout vec3 v_seen;\nvoid main() {\n"
    "write_position(u_world);\nv_seen = gl_Position.xyz;\ngl_Position = vec4(0.0, 0.0, 0.0, 1.0); }\n";
const std::string refraction_fragment =
    "in vec3 v_seen;\nout vec4 color;\nvoid main() { color = vec4(v_seen, 1.0); }\n";

/// Where the refraction view shows a point of the world, from an eye above the origin. probe: of the two
/// above.
glm::dvec3 shown_through_water(test::ShaderProbe &probe, const glm::vec3 &world, float eye_m, float index) {
    gl::FrameUniforms frame = test::plain_frame(1);
    frame.eye.y = eye_m;
    frame.water.w = 0.0F;
    probe.set_frame(frame);
    probe.set("u_clip_plane", {0.0F, 0.0F, 0.0F, 1.0F});
    probe.set("u_refraction_index", {index});
    probe.set("u_world", {world.x, world.y, world.z});
    const std::vector<float> pixel = probe.draw(GL_POINTS, 0, 1);
    return {pixel[0], pixel[1], pixel[2]};
}

} // namespace

TEST_CASE("wind: the floating origin does not move what the wind moves, in the player and in the shader") {
    if (!test::have_context()) {
        return;
    }
    test::ShaderProbe probe(16, wind_text);
    for (const double second : {0.0, 3.7, 100.0}) {
        const auto here = moved_by_wind(probe, glm::dvec3(0.0), second, {1.0F, 1.0F}),
                   elsewhere = moved_by_wind(probe, {13.0, 4.0, -29.0}, second, {1.0F, 1.0F});
        for (std::size_t i = 0; i < here.size(); ++i) {
            CHECK(glm::length(here[i] - elsewhere[i]) < 1e-4);
        }
    }
}

TEST_CASE("wind: plants lean the way it blows, leaves flutter along it and up and down, and roots stay") {
    if (!test::have_context()) {
        return;
    }
    test::ShaderProbe probe(16, wind_text);
    const glm::dvec3 blows(0.8, 0.0, -0.6);
    const auto reach = [&](const glm::vec2 &shares, const glm::dvec3 &along) { // least and most along an axis
        double least = 1e9, most = -1e9, aside = 0.0;
        for (const double second : {0.0, 1.3, 2.9, 7.1, 11.0}) {
            for (const glm::dvec3 &offset : moved_by_wind(probe, glm::dvec3(0.0), second, shares)) {
                least = std::min(least, glm::dot(offset, along));
                most = std::max(most, glm::dot(offset, along));
                aside = std::max(aside, std::abs(glm::dot(offset, glm::dvec3(0.6, 0.0, 0.8))));
            }
        }
        CHECK(aside < 1e-6);
        return glm::dvec2(least, most);
    };
    CHECK(reach({0.0F, 0.0F}, blows) == glm::dvec2(0.0));
    const glm::dvec2 lean = reach({1.0F, 0.0F}, blows), half = reach({0.5F, 0.0F}, blows);
    CHECK(lean.x > 0.0); // never against the wind
    CHECK(lean.x < 0.2 * 0.5);
    CHECK(lean.y > 0.85 * 0.5); // all of its reach, 0.5 m, in a full gust
    CHECK(lean.y < 1.001 * 0.5);
    CHECK(half.y == doctest::Approx(0.5 * lean.y));
    CHECK(reach({1.0F, 0.0F}, {0.0, 1.0, 0.0}) == glm::dvec2(0.0));
    const glm::dvec2 up = reach({0.0F, 1.0F}, {0.0, 1.0, 0.0}), along = reach({0.0F, 1.0F}, blows);
    CHECK(up.y > 0.08);
    CHECK(up.y < 0.1001);
    CHECK(up.x == test::within(-up.y, 0.15));
    CHECK(along.y > 0.02);
    CHECK(along.y < 0.7 * up.y);
    CHECK(along.x < -0.02);
    // Between gusts, of which the weakest has a fifth of a full one's strength, they flutter less.
    double squares = 0.0;
    for (const glm::dvec3 &offset : moved_by_wind(probe, glm::dvec3(0.0), 3.0, {0.0F, 1.0F})) {
        squares += offset.y * offset.y / 256.0;
    }
    CHECK(squares > 0.2 * 0.5 * 0.01);
    CHECK(squares < 0.65 * 0.5 * 0.01);
}

TEST_CASE(
    "refraction: what is under water is seen where Snell's law bends its ray to, and not below itself") {
    if (!test::have_context()) {
        return;
    }
    test::ShaderProbe probe(1, refraction_vertex, refraction_fragment);
    constexpr double index = 1.33;
    for (const float eye_m : {0.5F, 2.0F, 20.0F}) {
        for (const float depth_m : {0.1F, 1.0F, 5.0F}) {
            for (const float away_m : {0.5F, 3.0F, 10.0F, 30.0F}) {
                const glm::vec3 point(0.6F * away_m, -depth_m, 0.8F * away_m);
                const glm::dvec3 seen = shown_through_water(probe, point, eye_m, static_cast<float>(index));
                CHECK(seen.x == doctest::Approx(static_cast<double>(point.x)));
                CHECK(seen.z == doctest::Approx(static_cast<double>(point.z)));
                // The ray enters where the straight line to what is seen meets the water.
                const double entry_m = away_m * eye_m / (eye_m - seen.y);
                const double above = entry_m / std::hypot(entry_m, eye_m);
                const double below = (away_m - entry_m) / std::hypot(away_m - entry_m, depth_m);
                CHECK(above == test::within(index * below, 0.02));
                CHECK(seen.y > static_cast<double>(-depth_m));
                CHECK(seen.y < 0.0);
            }
        }
    }
    CHECK(shown_through_water(probe, {0.0F, -2.0F, 0.0F}, 3.0F, 1.33F).y == doctest::Approx(-2.0 / 1.33));
    CHECK(shown_through_water(probe, {0.001F, -2.0F, 0.0F}, 3.0F, 1.33F).y ==
          test::within(-2.0 / 1.33, 1e-3));
    CHECK(shown_through_water(probe, {1.0F, -2.0F, 0.0F}, 3.0F, 1.0F).y == -2.0); // in the other views
    CHECK(shown_through_water(probe, {1.0F, 0.5F, 0.0F}, 3.0F, 1.33F).y == 0.5);
    CHECK(shown_through_water(probe, {1.0F, -2.0F, 0.0F}, -1.0F, 1.33F).y == -2.0); // for an eye in the water
}

TEST_CASE("depth: metres from the eye come back out of a window depth") {
    if (!test::have_context()) {
        return;
    }
    constexpr int places = 64;
    test::ShaderProbe probe(places,
                            "#include \"lib/view_depth.glsl\"\nout vec4 color;\nuniform mat4 u_projection;\n"
                            "void main() {\nfloat metres = 0.5 * exp2(gl_FragCoord.x / 6.0);\n"
                            "vec4 clip = u_projection * vec4(0.0, 0.0, -metres, 1.0);\n"
                            "color = vec4(view_depth(0.5 + 0.5 * clip.z / clip.w), metres, 0.0, 1.0); }\n");
    gl::FrameUniforms frame = test::plain_frame(places);
    frame.lens = {0.5F, 1000.0F, 1.0F, 0.0F};
    probe.set_frame(frame);
    const glm::mat4 projection = glm::perspective(1.0F, 1.0F, 0.5F, 1000.0F);
    glUniformMatrix4fv(probe.use().location("u_projection"), 1, GL_FALSE, &projection[0][0]);
    const std::vector<float> pixels = probe.draw();
    for (std::size_t i = 0; i < places; ++i) {
        CHECK(pixels[4 * i] == test::within(pixels[4 * i + 1], 0.005));
    }
}

TEST_CASE("relief: flat ground stays, a raised one is seen where the ray meets it, and none farther than its "
          "limit") {
    if (!test::have_context()) {
        return;
    }
    constexpr float scale = 0.08F, bias = 0.01F;
    for (const std::string steps : {"PARALLAX_STEPS 1", "PARALLAX_STEPS 2", "PARALLAX_STEPS 16"}) {
        test::ShaderProbe probe(
            1, test::covering_vertex,
            "#include \"lib/parallax.glsl\"\nuniform sampler2D u_height;\nuniform vec3 u_view;\n"
            "uniform vec2 u_relief;\nout vec4 color;\nvoid main() {\n"
            "color = vec4(parallax_uv(u_height, vec2(0.5), u_view, u_relief.x, u_relief.y) - 0.5, 0.0, 1.0); "
            "}\n",
            {steps});
        const auto moved = [&](float height, const glm::vec3 &view, float bias_now) {
            const gl::Texture map = test::one_color(height, 0.0F, 0.0F, 1.0F);
            probe.set_texture("u_height", 0, GL_TEXTURE_2D, map);
            probe.set("u_view", {view.x, view.y, view.z});
            probe.set("u_relief", {scale, bias_now});
            const std::vector<float> pixel = probe.draw();
            return glm::dvec2(pixel[0], pixel[1]);
        };
        const glm::vec3 slanted = glm::normalize(glm::vec3(0.3F, 0.4F, 1.0F));
        CHECK(glm::length(moved(0.5F, slanted, 0.0F)) < 1e-6);
        CHECK(glm::length(moved(0.9F, {0.0F, 0.0F, 1.0F}, bias)) < 1e-6);
        const bool marches = steps == "PARALLAX_STEPS 16";
        for (const float height : {0.1F, 0.4F, 0.8F, 1.0F}) {
            const double z = (static_cast<double>(height) - 0.5) * scale + bias;
            const glm::dvec2 ray =
                glm::dvec2(slanted.x, -slanted.y) / (marches ? static_cast<double>(slanted.z) : 1.0);
            const double left = marches                       ? 0.0
                                : steps == "PARALLAX_STEPS 1" ? 0.25
                                                              : 0.0625; // after its iterations
            CHECK(glm::length(moved(height, slanted, bias) - (1.0 - left) * z * ray) < 1e-4);
            for (const glm::vec3 &grazing : {glm::vec3(0.999F, 0.0F, 0.02F), glm::vec3(1.5F, -1.5F, 0.1F)}) {
                CHECK(glm::length(moved(height, grazing, bias)) < 0.5 * scale + bias + 1e-6);
            }
        }
    }
}
