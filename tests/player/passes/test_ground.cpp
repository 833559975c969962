#include "context.hpp"
#include "shader_probe.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>
#include <glm/mat2x2.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

using namespace paradize;

namespace {

constexpr int ground_px = 64;

/// Distances from 1 m on, 64 in each doubling, and the scales of the sand there: near, far, blend.
std::vector<float> sand_scales() {
    test::ShaderProbe probe(
        ground_px, test::covering_vertex,
        "#define main draw_terrain\n#include \"terrain.frag\"\n#undef main\nvoid main() {\n"
        "float metres = exp2((floor(gl_FragCoord.y) * 64.0 + gl_FragCoord.x) / 512.0);\n"
        "SandScale s = sand_scale(metres);\nfragment = vec4(s.near, s.far, s.blend, metres); }\n");
    probe.set("u_sand_reference_m", {4.0F});
    return probe.draw();
}

} // namespace

TEST_CASE(
    "sand: each pixel covers about as many grains however far it is, and no scale jumps with the distance") {
    if (!test::have_context()) {
        return;
    }
    const std::vector<float> scales = sand_scales();
    double before = 1.0;
    for (std::size_t i = 0; i < scales.size(); i += 4) {
        const double near = scales[i], far = scales[i + 1], blend = scales[i + 2], metres = scales[i + 3];
        const double mean = std::exp(std::lerp(std::log(near), std::log(far), blend)); // of the octaves shown
        if (metres < 4.0) {
            CHECK(near == 1.0); // as baked up to there
            CHECK(blend == 0.0);
        } else {
            CHECK(metres * mean > 4.0 / 2.5);
            CHECK(metres * mean < 4.0 * 2.5);
        }
        CHECK(far == 0.25 * near);
        CHECK(mean <= before);
        CHECK(mean > 0.97 * before);
        before = mean;
    }
}

TEST_CASE(
    "noise: values lie in [0, 1] around a half, without a jump between cells, and dither is spread evenly") {
    if (!test::have_context()) {
        return;
    }
    test::ShaderProbe probe(ground_px, "#include \"lib/hash.glsl\"\nout vec4 color;\nvoid main() {\n"
                                       "vec2 p = gl_FragCoord.xy - 32.0;\n"
                                       "color = vec4(value_noise(p / 8.0), value_noise(3.7 * p), "
                                       "gradient_noise(gl_FragCoord.xy), 1.0); }\n");
    const std::vector<float> pixels = probe.draw();
    double mean = 0.0, variance = 0.0;
    std::array<int, 8> dither{};
    for (std::size_t i = 0; i < pixels.size() / 4; ++i) {
        const double smooth = pixels[4 * i], wild = pixels[4 * i + 1];
        CHECK(smooth >= 0.0);
        CHECK(smooth <= 1.0);
        if (i % ground_px > 0) {
            CHECK(std::abs(smooth - static_cast<double>(pixels[4 * (i - 1)])) <
                  1.9 / 8.0); // the steepest that it may be
        }
        mean += wild / (ground_px * ground_px);
        variance += (wild - 0.5) * (wild - 0.5) / (ground_px * ground_px);
        ++dither.at(static_cast<std::size_t>(8.0F * pixels[4 * i + 2]));
    }
    CHECK(std::abs(mean - 0.5) < 0.02);
    CHECK(variance > 0.02);
    CHECK(variance < 1.0 / 12.0); // of cells' own values
    CHECK(std::ranges::min(dither) > 0.9 * ground_px * ground_px / 8);
    CHECK(std::ranges::max(dither) < 1.1 * ground_px * ground_px / 8);
}

TEST_CASE("caustics: they are as bright as the waves that the sun shines through bundle its rays") {
    if (!test::have_context()) {
        return;
    }
    // Tilts change evenly over the waves, in x = 32 to the opposite. Two layers give twice that.
    const glm::dmat2 change(0.3, 0.5, 0.4, -0.2); // of the tilt (x, z), for each metre along x, and along z
    std::vector<float> texels;
    for (int row = 0; row < ground_px; ++row) {
        for (int column = 0; column < ground_px; ++column) {
            const glm::dvec2 place(column + 0.5 - 32.0, row + 0.5 - 32.0);
            const glm::dvec2 tilt = change[0] * -std::abs(place.x) + change[1] * place.y;
            texels.insert(texels.end(),
                          {static_cast<float>(tilt.x), static_cast<float>(-tilt.y), 0.0F, 1.0F});
        }
    }
    const gl::Texture waves = test::float_texture(ground_px, ground_px, texels);
    test::ShaderProbe probe(ground_px, "#include \"lib/underwater.glsl\"\nout vec4 color;\nvoid main() {\n"
                                       "float x = 30.0 + gl_FragCoord.x / 16.0;\n"
                                       "color = vec4(caustics(vec3(x, 0.0, 32.0), 1.0), "
                                       "caustics(vec3(x, 0.0, 32.0), 0.1), 0.0, 1.0); }\n");
    const std::array<float, 12> rows{1 / 64.0F, 0, 0, 1 / 64.0F, 1 / 64.0F, 0, 0, 1 / 64.0F};
    const std::array<float, 6> offsets{};
    probe.set_frame(test::plain_frame(ground_px));
    glUniform4fv(probe.use().location("u_wave_rows"), 3, rows.data());
    glUniform2fv(probe.use().location("u_wave_offsets"), 3, offsets.data());
    probe.set_texture("u_wave_normal", 0, GL_TEXTURE_2D, waves);
    probe.set("u_caustics", {1.0F});
    probe.set("u_sun_refracted", {0.6F, 0.8F, 0.0F}); // through the surface 0.75 m farther along x
    const std::vector<float> pixels = probe.draw();
    const auto wanted = [&](double side, double depth_m, double share) {
        const glm::dvec2 east = 2.0 * side * change[0], south = 2.0 * change[1];
        const double focus = 0.25 * depth_m; // 1 - 1 / 1.33
        const double area =
            (1.0 + focus * east.x) * (1.0 + focus * south.y) - focus * focus * east.y * south.x;
        return 1.0 + (std::sqrt(1.08 / (area * area + 0.08)) - 1.0) * share * std::exp(-0.12 * depth_m);
    };
    for (std::size_t i = 0; i < ground_px; ++i) {
        const double x = 30.0 + (static_cast<double>(i) + 0.5) / 16.0;
        const auto is = [&](float found, double depth_m, double share) {
            const double through = x + 0.75 * depth_m;
            // Not where the change itself turns.
            CHECK((std::abs(through - 31.9) < 0.8 ||
                   found == test::within(wanted(through < 32.0 ? 1.0 : -1.0, depth_m, share), 0.003)));
        };
        is(pixels[4 * i], 1.0, 1.0);
        const double t = 0.1 / 0.35; // at the waterline there are none yet
        is(pixels[4 * i + 1], 0.1, t * t * (3.0 - 2.0 * t));
    }
}

TEST_CASE("refraction: depths come back out of the picture's alpha, and where nothing was drawn it is deep") {
    if (!test::have_context()) {
        return;
    }
    test::ShaderProbe probe(ground_px, "#include \"lib/underwater.glsl\"\nout vec4 color;\nvoid main() {\n"
                                       "float depth = exp2(gl_FragCoord.x / 8.0) - 1.4;\n"
                                       "color = vec4(unpack_depth(pack_depth(depth)) - depth, depth, "
                                       "pack_depth(depth), gl_FragCoord.y < 1.0 ? unpack_depth(0.0) : "
                                       "pack_depth(-0.1 * floor(gl_FragCoord.x))); }\n");
    const std::vector<float> pixels = probe.draw();
    for (std::size_t i = 0; i < ground_px; ++i) {
        CHECK(std::abs(pixels[4 * i]) < 1e-4F * (1.0F + pixels[4 * i + 1] * pixels[4 * i + 1]));
        CHECK(pixels[4 * i + 3] > 400.0F);
        CHECK(pixels[4 * i + 2] < (i > 0 ? pixels[4 * i - 2] : 2.0F)); // the deeper, the less
        const float above = pixels[4 * (ground_px + i) + 3];           // a metre over the water too
        CHECK(above >= 1.0F);
        CHECK(above <= 2.0F);
    }
}
