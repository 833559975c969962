#include "context.hpp"
#include "shader_probe.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

using namespace paradize;

namespace {

constexpr int lobe_px = 128; // edge of a picture of directions

/// A probe of lib/brdf.glsl; body writes `color`.
test::ShaderProbe brdf_probe(const std::string &body, int side_px = lobe_px) {
    return {side_px, "#include \"lib/brdf.glsl\"\nuniform vec4 u_case;\nout vec4 color;\n"
                     "void main() {\nvec2 at = gl_FragCoord.xy / " +
                         std::to_string(side_px) + ".0;\n" + body + " }\n"};
}

/// Light from all around that GGX with height-correlated Smith reflects in one bounce: x as a factor of f0, y
/// of 1. Half vectors are drawn from the distribution: B. Walter et al., 2007; E. Heitz, 2014.
glm::dvec2 albedo_of(double n_v, double alpha) {
    const glm::dvec3 v(std::sqrt(1.0 - n_v * n_v), 0.0, n_v);
    const auto lambda = [&](double cosine) {
        return 0.5 * (std::sqrt(1.0 + alpha * alpha * (1.0 / (cosine * cosine) - 1.0)) - 1.0);
    };
    constexpr int steps = 96;
    glm::dvec2 sum(0.0);
    for (int i = 0; i < steps; ++i) {
        for (int j = 0; j < steps; ++j) {
            const double u = (i + 0.5) / steps, angle = 2.0 * M_PI * (j + 0.5) / steps;
            const double n_h = std::sqrt((1.0 - u) / (1.0 + (alpha * alpha - 1.0) * u));
            const double across = std::sqrt(1.0 - n_h * n_h);
            const glm::dvec3 h(across * std::cos(angle), across * std::sin(angle), n_h);
            const double v_h = glm::dot(v, h);
            const double n_l = 2.0 * v_h * n_h - n_v;
            if (n_l > 0.0 && v_h > 0.0) {
                const double weight = v_h / ((1.0 + lambda(n_v) + lambda(n_l)) * n_v * n_h);
                const double grazing = std::pow(1.0 - v_h, 5.0);
                sum += weight * glm::dvec2(1.0 - grazing, grazing);
            }
        }
    }
    return sum / static_cast<double>(steps * steps);
}

} // namespace

TEST_CASE("reflectance: microfacets cover the surface once, however rough it is") {
    if (!test::have_context()) {
        return;
    }
    test::ShaderProbe probe = brdf_probe("color = vec4(ggx_distribution(at.x, u_case.x)); ", 1024);
    for (const float alpha : {0.1F, 0.3F, 0.6F, 1.0F}) {
        probe.set("u_case", {alpha, 0.0F, 0.0F, 0.0F});
        const std::vector<float> pixels = probe.draw();
        double covered = 0.0;
        for (std::size_t i = 0; i < 1024; ++i) {
            const double cosine = (static_cast<double>(i) + 0.5) / 1024.0;
            covered += pixels[4 * i] * cosine * 2.0 * M_PI / 1024.0;
        }
        CHECK(covered == test::within(1.0, 0.01));
    }
}

TEST_CASE("reflectance: a metal reflects the sun's light as the theory says, and in both directions alike") {
    if (!test::have_context()) {
        return;
    }
    test::ShaderProbe probe = brdf_probe(
        "float y = 6.2831853 * at.y;\nfloat n_l = at.x;\nfloat s = sqrt(1.0 - n_l * n_l);\n"
        "vec3 l = vec3(s * cos(y), s * sin(y), n_l);\n"
        "vec3 v = vec3(sqrt(1.0 - u_case.y * u_case.y), 0.0, u_case.y);\nvec3 n = vec3(0.0, 0.0, 1.0);\n"
        "Reflector r = Reflector(0.0, vec3(u_case.z), 1.0);\n"
        "color = vec4(specular_ggx(n, v, l, r, u_case.x, 1e9).g, specular_ggx(n, l, v, r, u_case.x, 1e9).g, "
        "n_l, 1.0);");
    for (const float alpha : {0.2F, 0.5F, 0.9F}) {
        for (const float n_v : {0.3F, 0.7F, 0.95F}) {
            for (const float f0 : {1.0F, 0.2F}) {
                probe.set("u_case", {alpha, n_v, f0, 0.0F});
                const std::vector<float> pixels = probe.draw();
                double reflected = 0.0, most_unlike = 0.0;
                for (std::size_t i = 0; i < pixels.size(); i += 4) {
                    reflected += pixels[i] * 2.0 * M_PI / (lobe_px * lobe_px);
                    const double there = pixels[i] / pixels[i + 2],
                                 back = pixels[i + 1] / static_cast<double>(n_v);
                    most_unlike = std::max(most_unlike, std::abs(there - back) / (there + 0.01));
                }
                const glm::dvec2 wanted = albedo_of(static_cast<double>(n_v), static_cast<double>(alpha));
                const double all = wanted.x * static_cast<double>(f0) + wanted.y;
                CHECK(reflected > 0.8 * all); // Hammon's visibility is too dark at grazing angles
                CHECK(reflected < 1.03 * all);
                CHECK(most_unlike < 1e-3);
            }
        }
    }
}

TEST_CASE("reflectance: light from all around is reflected as the integral says, to 0.03") {
    if (!test::have_context()) {
        return;
    }
    constexpr int steps = 8;
    test::ShaderProbe probe = brdf_probe("color = vec4(directional_albedo(at.x, at.y), 0.0, 1.0);", steps);
    const std::vector<float> pixels = probe.draw();
    for (std::size_t row = 0; row < steps; ++row) {
        for (std::size_t column = 1; column < steps; ++column) {
            const float *found = &pixels[4 * (row * steps + column)];
            const auto half = [](std::size_t i) { return (static_cast<double>(i) + 0.5) / steps; };
            const glm::dvec2 wanted = albedo_of(half(column), half(row));
            CHECK(std::abs(static_cast<double>(found[0]) - wanted.x) < 0.03);
            CHECK(std::abs(static_cast<double>(found[1]) - wanted.y) < 0.03);
        }
    }
}

TEST_CASE(
    "reflectance: a white metal loses no light between its microfacets, a non-metal reflects none of no f0") {
    if (!test::have_context()) {
        return;
    }
    test::ShaderProbe probe = brdf_probe(
        "vec2 factors = directional_albedo(at.x, at.y);\n"
        "float all_around = environment_reflectance(Reflector(0.04, vec3(1.0), 1.0), factors).g;\n"
        "float by_sun = (factors.x + factors.y) * multiple_scattering(vec3(1.0), factors).g;\n"
        "color = vec4(all_around, by_sun, environment_reflectance(dielectric_reflector(0.0), factors).g,\n"
        "environment_reflectance(dielectric_reflector(0.04), factors).g);");
    const std::vector<float> pixels = probe.draw();
    for (std::size_t i = 0; i < pixels.size(); i += 4) {
        CHECK(pixels[i] == test::within(1.0, 0.001));
        CHECK(pixels[i + 1] == test::within(1.0, 0.001));
        CHECK(pixels[i + 2] == 0.0F);
        CHECK(pixels[i + 3] < 1.0F);
    }
}

TEST_CASE("reflectance: what bounces again on a non-metal is dimmed by its mean reflectance") {
    if (!test::have_context()) {
        return;
    }
    test::ShaderProbe probe = brdf_probe(
        "vec2 factors = directional_albedo(at.x, at.y);\n"
        "color = vec4(factors, environment_reflectance(dielectric_reflector(0.04), factors).g, 1.0);");
    double mean = 0.0; // of Schlick's reflectance, by the cosine
    for (int i = 0; i < 1000; ++i) {
        const double cosine = (i + 0.5) / 1000.0;
        mean += (0.04 + 0.96 * std::pow(1.0 - cosine, 5.0)) * 2.0 * cosine / 1000.0;
    }
    const std::vector<float> pixels = probe.draw();
    for (std::size_t i = 0; i < pixels.size(); i += 4) {
        const double x = pixels[i], y = pixels[i + 1];
        CHECK(pixels[i + 2] == test::within((0.04 * x + y) / (1.0 - mean * (1.0 - x - y)), 1e-3));
    }
}

TEST_CASE("reflectance: a highlight ends at its limit, and what leans away from the eye does not flare") {
    if (!test::have_context()) {
        return;
    }
    test::ShaderProbe probe =
        brdf_probe("vec3 n = vec3(0.0, 0.0, 1.0);\nReflector r = Reflector(0.0, vec3(1.0), 1.0);\n"
                   "float n_v = -0.3 * at.x;\nvec3 v = vec3(-sqrt(1.0 - n_v * n_v), 0.0, n_v);\n"
                   "vec3 l = vec3(0.866, 0.0, 0.5);\n"
                   "color = vec4(specular_ggx(n, n, n, r, 0.002, 16.0).g, "
                   "specular_ggx(n, v, l, r, 0.3, 1e9).g, 0.0, 1.0);");
    const std::vector<float> pixels = probe.draw();
    for (std::size_t i = 0; i < pixels.size(); i += 4) {
        CHECK(pixels[i] == 16.0F);
        CHECK(pixels[i + 1] < 6.0F); // the densest lobe, seen at a grazing angle
    }
}

TEST_CASE(
    "reflectance: a non-metal reflects f0 straight on and all at grazing angles, but nothing without f0") {
    if (!test::have_context()) {
        return;
    }
    test::ShaderProbe probe =
        brdf_probe("float x = floor(gl_FragCoord.x) / 127.0;\n"
                   "color = vec4(dielectric_fresnel(0.04, x), dielectric_fresnel(0.0, x),\n"
                   "reflectance_f90(dielectric_reflector(0.01)),\n"
                   "reflectance_f90(Reflector(0.0, vec3(0.5), 1.0)));");
    const std::vector<float> pixels = probe.draw();
    CHECK(pixels[4 * 127] == doctest::Approx(0.04));
    CHECK(pixels[0] == doctest::Approx(1.0));
    for (std::size_t i = 1; i < lobe_px; ++i) {
        CHECK(pixels[4 * i] <= pixels[4 * (i - 1)]);
        const double cosine = static_cast<double>(i) / 127.0, sine = std::sqrt(1.0 - cosine * cosine) / 1.5;
        const double below = std::sqrt(1.0 - sine * sine); // Fresnel's equations for glass
        const double along = (cosine - 1.5 * below) / (cosine + 1.5 * below);
        const double across = (1.5 * cosine - below) / (1.5 * cosine + below);
        CHECK(std::abs(static_cast<double>(pixels[4 * i]) - 0.5 * (along * along + across * across)) < 0.05);
        CHECK(pixels[4 * i + 1] == 0.0F);
    }
    CHECK(pixels[2] > 0.0F);
    CHECK(pixels[2] < 1.0F);
    CHECK(pixels[3] == 1.0F);
}

TEST_CASE("reflectance: in a crevice nothing is reflected, in the open all, and a rough surface as occluded "
          "as its light") {
    if (!test::have_context()) {
        return;
    }
    constexpr std::size_t steps = 32;
    test::ShaderProbe probe = brdf_probe(
        "color = vec4(specular_occlusion(at.x, at.y, u_case.x), specular_occlusion(at.x, 0.0, u_case.x),\n"
        "specular_occlusion(at.x, 1.0, u_case.x), 1.0);",
        steps);
    for (const float alpha : {0.01F, 0.3F, 1.0F}) {
        probe.set("u_case", {alpha, 0.0F, 0.0F, 0.0F});
        const std::vector<float> pixels = probe.draw();
        for (std::size_t i = 0; i < pixels.size(); i += 4) {
            CHECK(pixels[i] <= 1.0F);
            CHECK(pixels[i] >= (i < 4 * steps ? 0.0F : pixels[i - 4 * steps])); // the more, the less occluded
            CHECK(pixels[i + 1] == 0.0F);
            CHECK(pixels[i + 2] == 1.0F);
            const double open = (static_cast<double>(i / 4 / steps) + 0.5) / steps;
            const double n_v = (static_cast<double>(i / 4 % steps) + 0.5) / steps;
            const double power = std::exp2(-16.0 * static_cast<double>(alpha) - 1.0);
            const double reflected = std::clamp(std::pow(n_v + open, power) - 1.0 + open, 0.0, 1.0);
            CHECK(std::abs(static_cast<double>(pixels[i]) - reflected) < 1e-3);
            if (alpha == 1.0F) {
                CHECK(pixels[i] == test::within(open, 0.02));
            }
        }
    }
}

TEST_CASE("reflectance: roughness is the square of what smoothness leaves") {
    if (!test::have_context()) {
        return;
    }
    test::ShaderProbe probe =
        brdf_probe("color = vec4(alpha_of_smoothness(at.x), alpha_of_smoothness(2.0), 0.0, 1.0);");
    const std::vector<float> pixels = probe.draw();
    for (std::size_t i = 0; i < lobe_px; ++i) {
        const double rough = 1.0 - (static_cast<double>(i) + 0.5) / lobe_px;
        CHECK(pixels[4 * i] == test::within(std::max(rough * rough, 0.002), 1e-4));
        CHECK(pixels[4 * i + 1] > 0.0F);
    }
}
