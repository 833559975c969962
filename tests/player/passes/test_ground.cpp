#include "context.hpp"
#include "shader_probe.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

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

TEST_CASE("refraction: depths come back out of the picture's alpha, and where nothing was drawn it is deep") {
    if (!test::have_context()) {
        return;
    }
    test::ShaderProbe probe(ground_px, "#include \"lib/underwater.glsl\"\nout vec4 color;\nvoid main() {\n"
                                       "float depth = exp2(gl_FragCoord.x / 8.0) - 1.4;\n"
                                       "color = vec4(unpack_depth(pack_depth(depth)) - depth, depth, "
                                       "pack_depth(depth), unpack_depth(0.0)); }\n");
    const std::vector<float> pixels = probe.draw();
    for (std::size_t i = 0; i < ground_px; ++i) {
        CHECK(std::abs(pixels[4 * i]) < 1e-4F * (1.0F + pixels[4 * i + 1] * pixels[4 * i + 1]));
        CHECK(pixels[4 * i + 3] > 400.0F);
        CHECK(pixels[4 * i + 2] < (i > 0 ? pixels[4 * i - 2] : 2.0F)); // the deeper, the less
    }
}
