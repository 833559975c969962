#include "context.hpp"
#include "scene/ripples.hpp"
#include "shader_probe.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

using namespace paradize;

namespace {

constexpr int edge_px = 64;
constexpr double edge_m = 10.0;
constexpr double ripple_length_m = 0.6, falls_over_m = 1.3, reach_m = 4.0, seen_m = 15.0;

glm::dvec2 place_of(std::size_t pixel) {
    return (glm::dvec2(static_cast<double>(pixel % edge_px), static_cast<double>(pixel / edge_px)) + 0.5) *
               (edge_m / edge_px) -
           0.5 * edge_m;
}

/// The tilt that ripples add to the normal, over a square round the origin.
class RippleProbe {
  public:
    std::vector<glm::dvec2> tilts(const std::vector<glm::vec4> &rings, int count, double phase,
                                  double distance_m) {
        const gl::Program &program = probe_.use();
        std::vector<glm::vec4> all(rings);
        all.resize(most_rings); // each uniform is set
        glUniform4fv(program.location("u_rings"), most_rings, &all[0].x);
        glUniform2f(program.location("u_ripple_state"), static_cast<float>(count), static_cast<float>(phase));
        glUniform1f(program.location("u_distance_m"), static_cast<float>(distance_m));
        const std::vector<float> pixels = probe_.draw();
        std::vector<glm::dvec2> out;
        for (std::size_t i = 0; i < pixels.size(); i += 4) {
            out.emplace_back(pixels[i], pixels[i + 1]);
        }
        return out;
    }

  private:
    test::ShaderProbe probe_{edge_px, "#include \"lib/ripples.glsl\"\nuniform float u_distance_m;\n"
                                      "out vec4 color;\nvoid main() {\nvec2 xz = gl_FragCoord.xy * (" +
                                          std::to_string(edge_m / edge_px) + ") - " +
                                          std::to_string(0.5 * edge_m) +
                                          ";\ncolor = vec4(ripple_tilt(xz, u_distance_m), 0.0, 1.0); }\n"};
};

} // namespace

TEST_CASE("ripples: rings run outwards from a rim, lean along the radius, and fade within 4 m") {
    if (!test::have_context()) {
        return;
    }
    RippleProbe ripples;
    const glm::dvec2 middle(0.7, -0.4);
    constexpr double radius_m = 0.5, slope = 0.3, phase = 1.1;
    const std::vector<glm::vec4> rings{{0.7F, -0.4F, 0.5F, 0.3F}};
    const std::vector<glm::dvec2> first = ripples.tilts(rings, 1, phase, 0.0),
                                  quarter_later = ripples.tilts(rings, 1, phase + M_PI / 2, 0.0);
    double most_aside = 0.0, most_above = 0.0, most_below = 0.0, least_in_step = 1.0, most_beyond = 0.0;
    for (std::size_t i = 0; i < first.size(); ++i) {
        const glm::dvec2 way = place_of(i) - middle;
        const double away_m = glm::length(way) - radius_m;
        if (away_m < 0.0) {
            continue; // inside of what stands there
        }
        const glm::dvec2 outwards = way / glm::length(way);
        const double cosine = glm::dot(first[i], outwards), sine = glm::dot(quarter_later[i], outwards);
        most_aside = std::max(most_aside, glm::length(first[i] - cosine * outwards));
        const double fade = std::hypot(cosine, sine) / slope;
        const double wanted = std::exp(-away_m / falls_over_m);
        most_above = std::max(most_above, fade - wanted);
        if (away_m < 0.6 * reach_m) {
            most_below = std::max(most_below, wanted - fade);
            const double angle =
                2.0 * M_PI * away_m / ripple_length_m - phase; // less as time goes on: outwards
            least_in_step = std::min(least_in_step, std::cos(std::atan2(sine, cosine) - angle));
        } else if (away_m > reach_m) {
            most_beyond = std::max(most_beyond, fade);
        }
    }
    CHECK(most_aside < 1e-5);
    CHECK(most_above < 1e-4);
    CHECK(most_below < 1e-4);
    CHECK(least_in_step > 0.999);
    CHECK(most_beyond == 0.0);
}

TEST_CASE("ripples: those of several circles add up, as many as are counted") {
    if (!test::have_context()) {
        return;
    }
    RippleProbe ripples;
    const std::vector<glm::vec4> rings{
        {0.7F, -0.4F, 0.5F, 0.3F}, {-2.0F, 1.0F, 0.2F, 0.2F}, {1.0F, 2.5F, 0.1F, 0.4F}};
    std::vector<glm::dvec2> sum(std::size_t{edge_px} * edge_px);
    for (int count = 0; count <= 3; ++count) {
        const std::vector<glm::dvec2> found = ripples.tilts(rings, count, 0.4, 3.0);
        double most = 0.0;
        for (std::size_t i = 0; i < sum.size(); ++i) {
            most = std::max(most, glm::length(found[i] - sum[i]));
        }
        CHECK(most < 1e-5);
        if (count < 3) {
            const std::vector<glm::dvec2> next =
                ripples.tilts({rings[static_cast<std::size_t>(count)]}, 1, 0.4, 3.0);
            std::ranges::transform(sum, next, sum.begin(), std::plus<>());
        }
    }
}

TEST_CASE("ripples: seen from 7.5 m they begin to fade, and are gone at 15 m") {
    if (!test::have_context()) {
        return;
    }
    RippleProbe ripples;
    const std::vector<glm::vec4> rings{{0.7F, -0.4F, 0.5F, 0.3F}};
    const auto highest = [&](double distance_m) {
        double most = 0.0;
        for (const glm::dvec2 &tilt : ripples.tilts(rings, 1, 0.0, distance_m)) {
            most = std::max(most, glm::length(tilt));
        }
        return most;
    };
    const double near = highest(0.0);
    CHECK(highest(0.5 * seen_m) == doctest::Approx(near));
    CHECK(highest(0.75 * seen_m) == doctest::Approx(0.5 * near));
    CHECK(highest(0.99 * seen_m) < 0.01 * near);
    CHECK(highest(seen_m) == 0.0);
}
