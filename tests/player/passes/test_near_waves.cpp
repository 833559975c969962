#include "context.hpp"
#include "gl/texture.hpp"
#include "shader_probe.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

using namespace paradize;

namespace {

constexpr int side = 32; // of the picture, a place of the sea in each pixel
constexpr double length_m = 6.0, amplitude_m = 0.2, phase = 0.7;
const glm::dvec2 along(0.6, 0.8);
const glm::dvec2 eye_m(3.0, -2.0);

/// The points to which the shader lifts the sea around the eye, `step_m` apart.
class Lifted {
  public:
    /// wave: which of the four is not flat. shares: of two cells that the map has from -X to +X.
    std::vector<glm::dvec3> at(double step_m, int wave, bool tilt, glm::vec2 shares = {1.0F, 1.0F}) {
        const gl::Texture map = gl::make_target(GL_RGBA16F, 2, 1);
        gl::write_target(map, 2, 1, std::vector<float>{shares[0], 0, 0, 0, shares[1], 0, 0, 0});
        const gl::Program &program = probe_.use();
        gl::bind_texture(0, GL_TEXTURE_2D, map.name());
        glUniform1i(program.location("u_wave_shares"), 0);
        glUniform4f(program.location("eye"), static_cast<float>(eye_m.x), 1.0F, static_cast<float>(eye_m.y),
                    0.0F);
        glUniform4f(program.location("u_share_of_xz"), 0.125F, 0.125F, 0.5F - 0.125F * 3.0F, 0.5F);
        glUniform1f(program.location("u_step_m"), static_cast<float>(step_m));
        glUniform1i(program.location("u_tilt"), tilt ? 1 : 0);
        std::vector<float> waves;
        for (int i = 0; i < 4; ++i) {
            const double k = 2.0 * M_PI / length_m;
            for (const double value : {along.x * k, along.y * k, phase, i == wave ? amplitude_m : 0.0}) {
                waves.push_back(static_cast<float>(value));
            }
        }
        glUniform4fv(program.location("u_near_waves"), 4, waves.data());
        const std::vector<float> pixels = probe_.draw();
        std::vector<glm::dvec3> out;
        for (std::size_t i = 0; i < pixels.size(); i += 4) {
            out.emplace_back(pixels[i], pixels[i + 1], pixels[i + 2]);
        }
        return out;
    }

  private:
    test::ShaderProbe probe_{side,
                             "uniform vec4 eye;\n#include \"lib/near_waves.glsl\"\n"
                             "uniform float u_step_m;\nuniform bool u_tilt;\nout vec4 color;\n"
                             "void main() {\n"
                             "LiftedPoint p = lifted_point(eye.xz + (gl_FragCoord.xy - 16.0) * u_step_m);\n"
                             "color = u_tilt ? vec4(p.tilt, 0.0, 1.0) : vec4(p.offset, 1.0); }\n"};
};

glm::dvec2 place(std::size_t pixel, double step_m) {
    const glm::dvec2 at(static_cast<double>(pixel % side), static_cast<double>(pixel / side));
    return eye_m + (at - 15.5) * step_m;
}

/// Where a point of the calm sea is carried: on a circle that leans the way the wave runs.
glm::dvec3 carried(const glm::dvec2 &calm) {
    const double angle = 2.0 * M_PI / length_m * glm::dot(along, calm) + phase;
    return {calm.x + amplitude_m * along.x * std::cos(angle), amplitude_m * std::sin(angle),
            calm.y + amplitude_m * along.y * std::cos(angle)};
}

} // namespace

TEST_CASE("near waves: each carries points on circles, and tilts the surface as it then stands") {
    if (!test::have_context()) {
        return;
    }
    Lifted lifted;
    constexpr double step_m = 0.17; // all within a third of where they have faded out
    for (int wave = 0; wave < 4; ++wave) {
        const std::vector<glm::dvec3> offsets = lifted.at(step_m, wave, false),
                                      tilts = lifted.at(step_m, wave, true);
        for (std::size_t i = 0; i < offsets.size(); ++i) {
            const glm::dvec2 calm = place(i, step_m);
            const glm::dvec3 wanted = carried(calm) - glm::dvec3(calm.x, 0.0, calm.y);
            CHECK(glm::length(offsets[i] - wanted) < 1e-5);
            constexpr double h = 1e-4;
            const glm::dvec3 normal = glm::normalize(
                glm::cross(carried(calm + glm::dvec2(0.0, h)) - carried(calm - glm::dvec2(0.0, h)),
                           carried(calm + glm::dvec2(h, 0.0)) - carried(calm - glm::dvec2(h, 0.0))));
            CHECK(std::hypot(tilts[i].x - normal.x, tilts[i].y - normal.z) < 1e-5);
        }
    }
}

TEST_CASE("near waves: they fade out at two of their lengths from the eye, and end where their share is 0") {
    if (!test::have_context()) {
        return;
    }
    Lifted lifted;
    constexpr double step_m = 1.0;
    const std::vector<glm::dvec3> far = lifted.at(step_m, 0, false),
                                  shallow = lifted.at(step_m, 0, false, {0.0F, 1.0F});
    std::array<double, 3> highest{};
    for (std::size_t i = 0; i < far.size(); ++i) {
        const double lengths = glm::length(place(i, step_m) - eye_m) / length_m;
        double &most = highest[lengths < 1.0 ? 0 : lengths < 2.0 ? 1 : 2];
        most = std::max(most, glm::length(far[i]));
        const double right_m = place(i, step_m).x - eye_m.x; // between the middles of the cells: -2 to 2
        const double share = std::clamp(0.5 + right_m / 4.0, 0.0, 1.0);
        CHECK(glm::length(shallow[i] - share * far[i]) < 1e-3 * amplitude_m);
    }
    CHECK(highest[0] > 0.95 * amplitude_m);
    CHECK(highest[1] > 0.5 * amplitude_m);
    CHECK(highest[2] == 0.0);
}
