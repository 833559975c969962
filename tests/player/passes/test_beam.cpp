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

constexpr int beam_px = 128; // edge of the picture

/// A beam above the origin, seen without perspective.
class Beam {
  public:
    float height_m = 1e5F;
    glm::vec3 eye{0.0F, 5.0F, 1000.0F};
    float azimuth = 0.0F;                   // of the picture's plane, rad
    float low_m = 0.0F, shown_m = 10.0F;    // heights that the picture shows
    float half_m = 1.2F;                    // half its width
    float haze_per_m = 0.0F, clip_m = -1e6; // clipped below

    /// Radiance (green), rows from low to high.
    std::vector<std::vector<double>> rows() {
        gl::FrameUniforms frame = test::plain_frame(beam_px);
        frame.eye = {eye.x, eye.y, eye.z, 1.0F};
        frame.fog.w = haze_per_m;
        glm::mat4 shown(0.0F); // columns
        shown[0][0] = std::cos(azimuth) / half_m;
        shown[2][0] = -std::sin(azimuth) / half_m;
        shown[1][1] = 2.0F / shown_m;
        shown[3][1] = -1.0F - 2.0F * low_m / shown_m;
        shown[3][3] = 1.0F;
        frame.view_projection = shown;
        probe_.set_frame(frame);
        probe_.set("u_clip_plane", {0.0F, 1.0F, 0.0F, -clip_m});
        probe_.set("u_water_glow", {0.0F, 0.0F, 0.0F});
        probe_.set("u_water_scatter", {0.0F});
        glVertexAttrib4f(7, 0.0F, 0.0F, 0.0F, height_m);
        glVertexAttrib3f(8, 100.0F, 100.0F, 100.0F);
        glEnable(GL_CLIP_DISTANCE0);
        const std::vector<float> pixels = probe_.draw(GL_TRIANGLE_STRIP, 0, 4);
        glDisable(GL_CLIP_DISTANCE0);
        std::vector<std::vector<double>> out(beam_px);
        for (std::size_t i = 0; i < pixels.size(); i += 4) {
            out[i / 4 / beam_px].push_back(pixels[i + 1]);
        }
        return out;
    }
    double height_of_row(std::size_t row) const {
        return low_m + (static_cast<double>(row) + 0.5) * shown_m / beam_px;
    }
    double across_m() const { return 2.0 * half_m / beam_px; } // of a pixel

  private:
    test::ShaderProbe probe_{beam_px, "beam.vert", "beam.frag"};
};

double sum_of(const std::vector<double> &row) {
    double sum = 0.0;
    for (const double value : row) {
        sum += value;
    }
    return sum;
}

} // namespace

TEST_CASE("beam: all of its light passes through each height, from every side") {
    if (!test::have_context()) {
        return;
    }
    Beam beam;
    beam.half_m = 3.0F;
    beam.shown_m = 20.0F;
    for (const float azimuth : {0.0F, 0.8F, 2.9F}) {
        beam.azimuth = azimuth;
        beam.eye = {1000.0F * std::sin(azimuth), 5.0F, 1000.0F * std::cos(azimuth)};
        const auto rows = beam.rows();
        const double whole = sum_of(rows[10]);
        CHECK(whole > 0.0);
        for (std::size_t row = 2; row < rows.size(); ++row) { // from 0.3 m on
            CHECK(sum_of(rows[row]) == test::within(whole, 0.01));
        }
        CHECK(rows[100][beam_px / 2] < 0.7 * rows[30][beam_px / 2]); // wider and dimmer
    }
}

TEST_CASE("beam: across, it is a bell that ends in nothing, with no step at the strip's edges") {
    if (!test::have_context()) {
        return;
    }
    Beam beam;
    beam.low_m = 9.9F;
    beam.shown_m = 0.2F;
    const std::vector<double> row = beam.rows()[beam_px / 2];
    const double axis = 0.5 * (row[beam_px / 2] + row[beam_px / 2 - 1]);
    const auto half_width_m = [&](double share) { // where light has fallen to that share
        const auto lit = std::ranges::count_if(row, [&](double value) { return value >= share * axis; });
        return 0.5 * beam.across_m() * static_cast<double>(lit);
    };
    const double width_m = half_width_m(std::exp(-1.0));
    CHECK(half_width_m(std::exp(-4.0)) / width_m == test::within(2.0, 0.06)); // a bell
    const double steepest = std::sqrt(2.0 / M_E) / width_m;                   // of a bell
    double last_lit = 0.0;
    for (std::size_t i = 1; i < row.size(); ++i) {
        CHECK(std::abs(row[i] - row[i - 1]) < 1.1 * steepest * beam.across_m() * axis);
        last_lit = row[i] > 0.0 ? row[i] : last_lit;
    }
    CHECK(row.front() == 0.0);
    CHECK(row.back() == 0.0);
    CHECK(last_lit < 1e-3 * axis);
}

TEST_CASE("beam: it grows out of its lamp and has faded out at its height") {
    if (!test::have_context()) {
        return;
    }
    Beam beam;
    beam.shown_m = 0.4F;
    auto rows = beam.rows();
    CHECK(rows[0][beam_px / 2] < 0.002 * rows.back()[beam_px / 2]);
    for (std::size_t row = 1; row < rows.size() && beam.height_of_row(row) < 0.2; ++row) {
        CHECK(sum_of(rows[row]) > sum_of(rows[row - 1]));
    }
    beam.height_m = beam.shown_m = 10.0F;
    beam.eye.y = 5.0F;
    rows = beam.rows();
    for (std::size_t row = 5; row < rows.size(); ++row) {
        CHECK(sum_of(rows[row]) < sum_of(rows[row - 1]));
    }
    CHECK(sum_of(rows[beam_px * 95 / 100]) < 0.01 * sum_of(rows[4])); // no end is seen
}

TEST_CASE("beam: it is the brighter the more nearly one looks along it, and at most seven times as bright") {
    if (!test::have_context()) {
        return;
    }
    Beam beam;
    beam.low_m = 4.9F;
    beam.shown_m = 0.2F;
    const auto axis_from = [&](const glm::vec3 &eye) {
        beam.eye = eye;
        return beam.rows()[beam_px / 2][beam_px / 2];
    };
    const double aside = axis_from({0.0F, 5.0F, 1000.0F});
    // Through twice as much of it where the ray climbs at 60 degrees.
    CHECK(axis_from({0.0F, 5.0F - 866.025F, 500.0F}) == test::within(2.0 * aside, 0.01));
    const double along = axis_from({0.0F, -1000.0F, 0.0F});
    CHECK(along > 3.0 * aside);
    CHECK(along < 7.0 * aside);
}

TEST_CASE("beam: haze takes as much of it as of a surface there") {
    if (!test::have_context()) {
        return;
    }
    Beam beam;
    beam.eye.z = 300.0F;
    const double clear = beam.rows()[beam_px / 2][beam_px / 2];
    beam.haze_per_m = 0.002F;
    const double hazy = beam.rows()[beam_px / 2][beam_px / 2];
    test::ShaderProbe surface(1, "#include \"lib/fog.glsl\"\nout vec4 color;\nvoid main() {\n"
                                 "color = vec4(apply_haze(vec3(1.0), vec3(0.0, 5.0, 0.0)), 1.0); }\n");
    gl::FrameUniforms frame = test::plain_frame(1);
    frame.eye = {0.0F, 5.0F, 300.0F, 1.0F};
    frame.fog.w = beam.haze_per_m; // black: what is left is the surface's light
    surface.set_frame(frame);
    surface.set("u_water_glow", {0.0F, 0.0F, 0.0F});
    surface.set("u_water_scatter", {0.0F});
    const double left = surface.draw()[1];
    CHECK(left == test::within(std::exp(-300.0 * 0.002 * 0.95), 1e-3)); // of green
    CHECK(hazy / clear == test::within(left, 1e-3));
}

TEST_CASE("beam: the mirror view has nothing of it below the water") {
    if (!test::have_context()) {
        return;
    }
    Beam beam;
    const auto whole = beam.rows();
    beam.clip_m = 5.0F;
    const auto clipped = beam.rows();
    for (std::size_t row = 4; row < clipped.size(); ++row) {
        if (beam.height_of_row(row) < 5.0) {
            CHECK(sum_of(clipped[row]) == 0.0);
        } else {
            CHECK(sum_of(clipped[row]) == test::within(sum_of(whole[row]), 1e-4));
        }
    }
}
