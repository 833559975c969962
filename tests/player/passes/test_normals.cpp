#include "context.hpp"
#include "shader_probe.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

using namespace paradize;

namespace {

constexpr int tilts = 32; // edge of a picture of tilts from -1 to 1

/// Calls functions of a library for each tilt `at`; body writes `color`.
std::vector<float> for_tilts(const std::string &library, const std::string &body) {
    test::ShaderProbe probe(tilts, "#include \"lib/" + library +
                                       ".glsl\"\nout vec4 color;\nvoid main() {\n"
                                       "vec2 at = gl_FragCoord.xy / 16.0 - 1.0;\n" +
                                       body + " }\n");
    probe.set_frame(test::plain_frame(tilts));
    if (library == "waves") {
        // Layer 0 runs at 30 degrees, layer 1 is mirrored and larger.
        const std::array<float, 12> rows{0.0866F, 0.05F, -0.05F, 0.0866F, -0.2F, 0, 0, 0.2F, 1, 0, 0, 1};
        const std::array<float, 6> offsets{};
        glUniform4fv(probe.use().location("u_wave_rows"), 3, rows.data());
        glUniform2fv(probe.use().location("u_wave_offsets"), 3, offsets.data());
    }
    return probe.draw();
}

} // namespace

TEST_CASE(
    "normals: maps hold unit vectors that face outwards, and too long ones become the flattest that do") {
    if (!test::have_context()) {
        return;
    }
    const std::vector<float> pixels = for_tilts("normal", "color = vec4(decode_normal(at, 1.0), 1.0);");
    for (std::size_t i = 0; i < pixels.size(); i += 4) {
        const glm::dvec3 n(pixels[i], pixels[i + 1], pixels[i + 2]);
        CHECK(glm::length(n) == test::within(1.0, 1e-5));
        CHECK(n.z > 0.1);
        const glm::dvec3 held((static_cast<double>(i / 4 % tilts) + 0.5) / 16.0 - 1.0,
                              (static_cast<double>(i / 4 / tilts) + 0.5) / 16.0 - 1.0, 0.0);
        CHECK(glm::dot(n, held) > 0.0);
        CHECK(std::abs(n.x * held.y - n.y * held.x) < 1e-5); // the same way
        if (glm::length(held) < 0.98) {
            CHECK(std::hypot(n.x - held.x, n.y - held.y) < 1e-5);
        }
    }
}

TEST_CASE("normals: a map's x runs along the tangent, y up the image, also where the image is mirrored") {
    if (!test::have_context()) {
        return;
    }
    const auto turned_by = [](const std::string &normal) {
        return for_tilts(
            "normal",
            "vec3 local = decode_normal(at, 0.7);\nfloat w = gl_FragCoord.x < 16.0 ? 1.0 : -1.0;\n"
            "vec3 world = tangent_to_world(local, " +
                normal +
                ", vec4(1.0, 0.0, 0.0, w));\n"
                "color = vec4(world.x - local.x, world.y - local.z, world.z + w * local.y, length(world)); ");
    };
    const std::vector<float> pixels = turned_by("vec3(0.0, 2.0, 0.0)");
    for (std::size_t i = 0; i < pixels.size(); i += 4) {
        // Interpolated vectors are not normalised: a longer normal counts for more.
        CHECK(pixels[i + 3] == test::within(1.0, 1e-5));
    }
    const std::vector<float> unit = turned_by("vec3(0.0, 1.0, 0.0)");
    for (std::size_t i = 0; i < unit.size(); i += 4) {
        CHECK(std::abs(unit[i]) < 1e-5F);
        CHECK(std::abs(unit[i + 1]) < 1e-5F);
        CHECK(std::abs(unit[i + 2]) < 1e-5F); // +Y, +X: up the image is -Z
    }
}

TEST_CASE("normals: blending with a flat map changes nothing, and its order neither") {
    if (!test::have_context()) {
        return;
    }
    const std::vector<float> pixels = for_tilts(
        "normal", "vec3 a = decode_normal(at, 0.6);\nvec3 b = decode_normal(vec2(0.4, -0.2), 1.0);\n"
                  "color = vec4(length(blend_normals(a, vec3(0.0, 0.0, 1.0)) - a), length(blend_normals(a, "
                  "b) - blend_normals(b, a)),\n"
                  "length(blend_normals(a, b)), blend_normals(b, b).x / b.x);");
    for (std::size_t i = 0; i < pixels.size(); i += 4) {
        CHECK(pixels[i] < 1e-5F);
        CHECK(pixels[i + 1] < 1e-5F);
        CHECK(pixels[i + 2] == test::within(1.0, 1e-5));
        CHECK(pixels[i + 3] > 1.4F); // slopes add up
        CHECK(pixels[i + 3] < 2.0F);
    }
}

TEST_CASE("normals: highlights stay as they are on a plane, and widen with the curvature inside a pixel") {
    if (!test::have_context()) {
        return;
    }
    float footprint_px = 1.0F;
    const auto widened = [&](const std::string &normal) {
        test::ShaderProbe probe(
            tilts, "#include \"lib/specular_antialiasing.glsl\"\nout vec4 color;\nvoid main() {\n"
                   "float x = gl_FragCoord.x;\n"
                   "color = vec4(filtered_alpha(normalize(" +
                       normal + "), 0.2), filtered_alpha(normalize(" + normal + "), 1.0), 0.0, 1.0); }\n");
        gl::FrameUniforms frame = test::plain_frame(tilts);
        frame.ambient.w = footprint_px;
        probe.set_frame(frame);
        const std::vector<float> pixels = probe.draw();
        CHECK(pixels[4 * 16 + 1] == 1.0F);
        return static_cast<double>(pixels[4 * 16]);
    };
    CHECK(widened("vec3(0.3, 1.0, 0.2)") == doctest::Approx(0.2));
    const double little = widened("vec3(sin(0.1 * x), 1.0 * cos(0.1 * x), 0.0)"),
                 much = widened("vec3(sin(0.3 * x), cos(0.3 * x), 0.0)"),
                 most = widened("vec3(sin(1.5 * x), cos(1.5 * x), 0.0)");
    // A quarter of the squared change from pixel to pixel adds to the squared roughness.
    CHECK(little == test::within(std::sqrt(0.04 + 0.25 * 0.01), 0.01));
    CHECK(much > little);
    CHECK(most > much);
    CHECK(most < 0.5);
    footprint_px = 0.0F; // --reference draws points of a pixel
    CHECK(widened("vec3(sin(0.3 * x), cos(0.3 * x), 0.0)") == doctest::Approx(0.2));
}

TEST_CASE("waves: a layer's slopes turn with it, and none leans farther than a wave can") {
    if (!test::have_context()) {
        return;
    }
    const std::vector<float> turned = for_tilts(
        "waves", "color = vec4(wave_to_world(0, vec2(1.0, 0.0)), wave_to_world(0, vec2(0.0, 1.0)));");
    CHECK(turned[0] == test::within(std::cos(M_PI / 6), 1e-3)); // x runs along u
    CHECK(turned[1] == test::within(std::sin(M_PI / 6), 1e-3));
    CHECK(turned[2] == test::within(std::sin(M_PI / 6), 1e-3)); // y against v
    CHECK(turned[3] == test::within(-std::cos(M_PI / 6), 1e-3));
    const std::vector<float> normals = for_tilts("waves", "color = vec4(wave_normal(2.0 * at), 1.0);");
    for (std::size_t i = 0; i < normals.size(); i += 4) {
        CHECK(std::hypot(normals[i], normals[i + 1], normals[i + 2]) == test::within(1.0, 1e-5));
        CHECK(normals[i + 1] > 0.3F);
    }
}
