#include "context.hpp"
#include "gl/buffer.hpp"
#include "gl/light_uniforms.hpp"
#include "gl/texture.hpp"
#include "shader_probe.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

using namespace paradize;

namespace {

constexpr int views = 32; // edge of a picture of views

const std::string surface_text =
    "#include \"lib/light.glsl\"\nuniform vec3 u_place;\nuniform vec3 u_normal;\nuniform vec3 "
    "u_bump;\nuniform vec3 u_albedo;\n"
    "uniform vec4 u_shine;\nuniform vec4 u_metal;\nuniform float u_spread;\nout vec4 color;\n"
    "void main() {\nvec2 at = gl_FragCoord.xy / 32.0;\n"
    // From all around the normal +Y, or from the eye's own place.
    "vec3 v = vec3(sqrt(1.0 - at.x * at.x) * vec2(cos(6.2831853 * at.y), sin(6.2831853 * at.y)), at.x).xzy;\n"
    "Surface s = matte_surface(mix(u_place, eye.xyz - 0.1 * v, u_spread), normalize(u_normal + u_bump), "
    "u_normal, u_albedo, "
    "sky_zenith());\n"
    "s.reflector = Reflector(u_shine.x, u_metal.rgb, u_metal.a);\ns.alpha = u_shine.y;\ns.translucency = "
    "u_shine.z;\n"
    "s.occlusion = u_shine.w;\ncolor = vec4(shade(s), v.y); }\n";

/// A surface in the light of sun, sky and lamps, seen from 1 m above the origin.
class LitSurface {
  public:
    glm::vec3 place{0.0F}, normal{0.0F, 1.0F, 0.0F}, albedo{1.0F};
    glm::vec3 bump{0.0F}; // added to the normal by its map
    float f0 = 0.0F, alpha = 0.5F, translucency = 0.0F, occlusion = 1.0F;
    glm::vec4 metal{0.0F};
    glm::vec3 to_sun{0.0F, 1.0F, 0.0F}, sun{0.0F}, ambient{0.0F};
    glm::vec4 water{0.0F, 0.0F, 0.0F, -1e9F}; // absorption, 1/m; level, m
    float refracting = 0.0F, sky_blur = 1.0F, trimmed_mips = 0.0F;
    gl::Texture sky = test::float_cube(2, [](const glm::vec3 &) { return glm::vec3(1.0F); });
    gl::LightUniforms lamps;
    bool has_shadow = false; // of all that lies below y = 0

    /// defines: of lib/light.glsl.
    explicit LitSurface(std::string_view defines = "SKY_LIGHT 1")
        : probe_(views, test::covering_vertex, surface_text, {"POINT_LIGHTS 1", defines}) {}

    glm::dvec3 seen() {
        const std::vector<float> pixels = draw(0.0F);
        return {pixels[0], pixels[1], pixels[2]};
    }
    /// Green light that leaves into all directions, over pi. The normal is +Y.
    double all_around() {
        const std::vector<float> pixels = draw(1.0F);
        double sum = 0.0;
        for (std::size_t i = 0; i < pixels.size(); i += 4) {
            sum += pixels[i + 1] * static_cast<double>(pixels[i + 3]) * 2.0 / (views * views);
        }
        return sum;
    }

  private:
    std::vector<float> draw(float spread) {
        gl::FrameUniforms frame = test::plain_frame(views);
        frame.sun_direction = glm::vec4(to_sun, 0.005F);
        frame.sun_radiance = glm::vec4(sun, has_shadow ? 1.0F : 0.0F);
        frame.shadow_from_world = glm::mat4(0.0F);
        frame.shadow_from_world[1].z = -0.01F;
        frame.shadow_from_world[3] = glm::vec4(0.5F, 0.5F, 0.5F, 1.0F);
        const float ground = 0.5F;
        glBindTexture(GL_TEXTURE_2D_ARRAY, no_shadow_.name());
        glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, 1, 1, 1, GL_DEPTH_COMPONENT, GL_FLOAT, &ground);
        frame.ambient = glm::vec4(ambient, 1.0F);
        frame.water = water;
        probe_.set_frame(frame);
        gl::write_buffer(GL_UNIFORM_BUFFER, lights_, 0, std::as_bytes(std::span(&lamps, 1)));
        glBindBufferBase(GL_UNIFORM_BUFFER, gl::light_uniforms_binding, lights_.name());
        const auto set = [&](const char *name, const glm::vec3 &v) { probe_.set(name, {v.x, v.y, v.z}); };
        set("u_place", place);
        set("u_normal", normal);
        set("u_bump", bump);
        set("u_albedo", albedo);
        probe_.set("u_shine", {f0, alpha, translucency, occlusion});
        probe_.set("u_metal", {metal.r, metal.g, metal.b, metal.a});
        probe_.set("u_spread", {spread});
        probe_.set_texture("u_sky", 0, GL_TEXTURE_CUBE_MAP, sky);
        probe_.set_texture("u_shadow_map", 1, GL_TEXTURE_2D_ARRAY, no_shadow_);
        probe_.set_texture("u_wave_normal", 2, GL_TEXTURE_2D, calm_);
        probe_.set("u_sky_blur", {sky_blur});
        probe_.set("u_sky_trimmed_mips", {trimmed_mips});
        probe_.set("u_refracting", {refracting});
        probe_.set("u_caustics", {1.0F});
        glm::vec3 refracted(to_sun.x / 1.33F, 0.0F, to_sun.z / 1.33F);
        refracted.y = std::sqrt(1.0F - glm::dot(refracted, refracted));
        set("u_sun_refracted", refracted);
        probe_.set("u_shadow_cascades", {1.0F, 0.0F, 0.0F, 1.0F});
        probe_.set("u_shadow_texel", {1.0F});
        probe_.set("u_shadow_penumbra_m", {0.0F});
        probe_.set("u_shadow_blur_m", {0.0F});
        const std::array<float, 12> rows{0.1F, 0, 0, 0.1F, 0.1F, 0, 0, 0.1F, 0.1F, 0, 0, 0.1F};
        const std::array<float, 6> offsets{};
        glUniform4fv(probe_.use().location("u_wave_rows"), 3, rows.data());
        glUniform2fv(probe_.use().location("u_wave_offsets"), 3, offsets.data());
        return probe_.draw();
    }

    test::ShaderProbe probe_;
    gl::Texture no_shadow_ = gl::make_depth_comparison_layers(1, 1), calm_ = test::one_color(0, 0, 0, 0);
    gl::Buffer lights_ =
        gl::make_buffer(GL_UNIFORM_BUFFER, 31 * sizeof(gl::LightUniforms), gl::Usage::streamed);
};

glm::vec3 tilted(double degrees) {
    const double angle = degrees * M_PI / 180.0;
    return {std::sin(angle), std::cos(angle), 0.0};
}

} // namespace

TEST_CASE("surface: matte white in an irradiance of pi has a radiance of 1, and falls with the cosine") {
    if (!test::have_context()) {
        return;
    }
    LitSurface surface;
    surface.sun = glm::vec3(static_cast<float>(M_PI));
    surface.albedo = {1.0F, 0.5F, 0.25F};
    surface.occlusion = 0.0F; // of the light from all around alone
    for (const double degrees : {0.0, 30.0, 60.0, 80.0}) {
        surface.to_sun = tilted(degrees);
        const double cosine = std::cos(degrees * M_PI / 180.0);
        CHECK(glm::length(surface.seen() - glm::dvec3(surface.albedo) * cosine) < 1e-4);
    }
    surface.to_sun = tilted(95.0);
    CHECK(surface.seen().r == 0.0);
    // A bump that faces the sun on a side that does not is dark, and one on a side that faces it is not
    // darkened.
    surface.bump = {1.0F, 0.0F, 0.0F};
    surface.to_sun = tilted(100.0);
    CHECK(surface.seen().r == 0.0);
    surface.to_sun = tilted(80.0);
    CHECK(surface.seen().r == test::within(std::cos(35.0 * M_PI / 180.0), 1e-3));
}

TEST_CASE("surface: white in a white sky is as bright as the sky, whatever it is made of") {
    if (!test::have_context()) {
        return;
    }
    LitSurface surface;
    surface.ambient = glm::vec3(1.0F);
    CHECK(surface.seen().g == doctest::Approx(1.0));
    for (const float alpha : {0.01F, 0.2F, 0.6F, 1.0F}) {
        surface.alpha = alpha;
        surface.place = {0.0F, 0.0F, 0.0F};
        for (const float aside_m : {0.0F, 1.0F, 4.0F}) {
            surface.place.x = aside_m;
            surface.f0 = 0.04F;
            surface.metal = glm::vec4(0.0F);
            surface.albedo = glm::vec3(1.0F);
            CHECK(surface.seen().g == test::within(1.0, 0.001));
            surface.metal = glm::vec4(1.0F);
            surface.albedo = glm::vec3(0.0F);
            CHECK(surface.seen().g == test::within(1.0, 0.001));
        }
    }
}

TEST_CASE("surface: of the sun's light as much leaves white as arrives, be it reflected or scattered") {
    if (!test::have_context()) {
        return;
    }
    LitSurface surface;
    surface.sun = glm::vec3(static_cast<float>(M_PI));
    for (const double degrees : {20.0, 50.0, 70.0}) {
        surface.to_sun = tilted(degrees);
        const double arrives = std::cos(degrees * M_PI / 180.0);
        surface.f0 = 0.0F;
        CHECK(surface.all_around() == test::within(arrives, 0.005));
        surface.f0 = 0.04F;
        CHECK(surface.all_around() > 0.99 * arrives);
        // glTF's mix of the two gives a tenth too much where the sun is low.
        CHECK(surface.all_around() < (degrees < 30.0 ? 1.035 : degrees < 60.0 ? 1.06 : 1.12) * arrives);
    }
    // Most of what a rough metal reflects bounces more than once. The fit is no more exact.
    LitSurface metal;
    metal.sky = test::float_cube(2, [](const glm::vec3 &) { return glm::vec3(0.0F); });
    metal.sun = glm::vec3(static_cast<float>(M_PI));
    metal.albedo = glm::vec3(0.0F);
    metal.metal = glm::vec4(1.0F);
    metal.alpha = 1.0F;
    for (const double degrees : {20.0, 50.0, 70.0}) {
        metal.to_sun = tilted(degrees);
        CHECK(metal.all_around() == test::within(std::cos(degrees * M_PI / 180.0), 0.3));
    }
}

TEST_CASE(
    "surface: a leaf lets light from behind through, yellower, and in the light from all around half of it") {
    if (!test::have_context()) {
        return;
    }
    LitSurface leaf;
    leaf.sun = glm::vec3(static_cast<float>(M_PI));
    leaf.to_sun = tilted(180.0);
    CHECK(leaf.seen().g == 0.0);
    leaf.translucency = 0.5F;
    const glm::dvec3 through = leaf.seen();
    CHECK(through.r > through.g);
    CHECK(through.g > 2.0 * through.b);
    CHECK(through.g == test::within(0.5, 0.2));
    leaf.to_sun = tilted(120.0);
    CHECK(leaf.seen().g == doctest::Approx(0.5 * through.g));
    leaf.to_sun = tilted(0.0);
    CHECK(leaf.seen().g == doctest::Approx(1.0)); // no more than matte
    leaf.sun = glm::vec3(0.0F);
    leaf.ambient = glm::vec3(1.0F);
    CHECK(leaf.seen().g - 1.0 == doctest::Approx(0.5 * through.g));
}

TEST_CASE("surface: what is occluded is darker in the sky's light, and as bright in the sun's") {
    if (!test::have_context()) {
        return;
    }
    LitSurface surface;
    surface.ambient = glm::vec3(1.0F);
    surface.occlusion = 0.25F;
    CHECK(surface.seen().g == doctest::Approx(0.25));
    surface.occlusion = 0.0F;
    surface.albedo = glm::vec3(0.0F);
    surface.metal = glm::vec4(1.0F);
    CHECK(surface.seen().g < 1e-3);
    surface.occlusion = 1.0F;
    CHECK(surface.seen().g == test::within(1.0, 0.001));
    // A smooth metal, seen from straight above, mirrors more than its share of the light from all around.
    surface.occlusion = 0.5F;
    surface.alpha = 0.01F;
    CHECK(surface.seen().g == test::within(std::pow(1.5, std::exp2(-1.16)) - 0.5, 0.01));
    // Of a leaf also the light that comes through it.
    surface.metal = glm::vec4(0.0F);
    surface.albedo = glm::vec3(1.0F);
    surface.translucency = 1.0F;
    const double half = surface.seen().g;
    surface.occlusion = 1.0F;
    CHECK(half == doctest::Approx(0.5 * surface.seen().g));
}

TEST_CASE("surface: a leaf does not shade the light that passes through it") {
    if (!test::have_context()) {
        return;
    }
    LitSurface leaf;
    leaf.normal = {0.0F, -1.0F, 0.0F};
    leaf.sun = glm::vec3(1.0F);
    leaf.translucency = 1.0F;
    const double bare = leaf.seen().g;
    CHECK(bare > 0.1);
    leaf.has_shadow = true;
    CHECK(leaf.seen().g == doctest::Approx(bare));
    leaf.place.y = -5.0F;
    CHECK(leaf.seen().g == 0.0);
}

TEST_CASE(
    "surface: bumps turn no light onto a triangle that faces away from it, be it the sun's or a lamp's") {
    if (!test::have_context()) {
        return;
    }
    LitSurface surface;
    surface.bump = {2.0F, 0.0F, 0.0F};
    for (const bool behind : {false, true}) {
        const glm::vec3 to_light = glm::normalize(glm::vec3(1.0F, behind ? -0.2F : 0.2F, 0.0F));
        surface.to_sun = to_light;
        surface.sun = glm::vec3(1.0F);
        surface.lamps.state.x = 0.0F;
        const double by_sun = surface.seen().g;
        surface.sun = glm::vec3(0.0F);
        surface.lamps.state = {1.0F, 1.0F, 0.0F, 0.0F};
        surface.lamps.place[0] = glm::vec4(10.0F * to_light, 1e6F);
        surface.lamps.color[0] = {100.0F, 100.0F, 100.0F, 0.001F};
        CHECK((by_sun == 0.0) == behind);
        CHECK(std::abs(surface.seen().g - by_sun) <= 0.01 * by_sun);
    }
}

TEST_CASE("surface: without a lookup, sides have more of the sky's light than a roof") {
    if (!test::have_context()) {
        return;
    }
    LitSurface surface("SKY_LIGHT 0");
    surface.ambient = glm::vec3(1.0F);
    CHECK(surface.seen().g == doctest::Approx(1.0));
    surface.normal = {1.0F, 0.0F, 0.0F};
    CHECK(surface.seen().g == doctest::Approx(2.1));
}

TEST_CASE("surface: without a sky, what faces down has half of the light of what faces up") {
    if (!test::have_context()) {
        return;
    }
    LitSurface surface;
    surface.ambient = {0.2F, 0.4F, 0.6F};
    surface.sky_blur = -1.0F;
    CHECK(glm::length(surface.seen() - glm::dvec3(surface.ambient)) < 1e-6);
    surface.normal = {0.0F, -1.0F, 0.0F};
    CHECK(glm::length(surface.seen() - 0.5 * glm::dvec3(surface.ambient)) < 1e-6);
}

TEST_CASE("surface: a side sees its part of the sky, though never more than four times what a roof has") {
    if (!test::have_context()) {
        return;
    }
    LitSurface surface;
    surface.ambient = glm::vec3(1.0F);
    surface.sky_blur = 0.0F;
    const auto bright_in_the_east = [](float radiance) {
        return test::float_cube(16,
                                [=](const glm::vec3 &d) { return glm::vec3(d.x > 0.7F ? radiance : 1.0F); });
    };
    surface.sky = bright_in_the_east(3.0F);
    CHECK(surface.seen().g == doctest::Approx(1.0)); // the scene's ambient light is that of a roof
    surface.bump = {1e3F, 0.0F, 0.0F};               // its map turns it there
    CHECK(surface.seen().g == doctest::Approx(3.0));
    surface.bump = glm::vec3(0.0F);
    surface.normal = {1.0F, 0.0F, 0.0F};
    CHECK(surface.seen().g == doctest::Approx(3.0));
    surface.sky = bright_in_the_east(50.0F);
    CHECK(surface.seen().g == doctest::Approx(4.0));
    // That of the roof is blurred as that of the side is.
    surface.sky =
        test::float_cube(16, [](const glm::vec3 &d) { return glm::vec3(d.y > 0.97F ? 50.0F : 1.0F); });
    surface.sky_blur = 3.0F;
    surface.normal = {0.0F, 1.0F, 0.0F};
    CHECK(surface.seen().g == doctest::Approx(1.0));
}

TEST_CASE("surface: smooth metal mirrors the sharp sky, rough metal the blurred one, ever more so") {
    if (!test::have_context()) {
        return;
    }
    LitSurface surface;
    surface.albedo = glm::vec3(0.0F);
    surface.metal = glm::vec4(1.0F);
    surface.sky_blur = 5.0F;
    surface.sky =
        test::float_cube(64, [](const glm::vec3 &d) { return glm::vec3(d.y > 0.98F ? 100.0F : 0.0F); });
    double before = 101.0;
    for (const float alpha : {0.002F, 0.05F, 0.2F, 0.5F, 1.0F}) {
        surface.alpha = alpha;
        const double now = surface.seen().g;
        CHECK(now < before);
        before = now;
    }
    surface.alpha = 0.002F;
    CHECK(surface.seen().g > 90.0);
    surface.alpha = 1.0F;
    CHECK(surface.seen().g < 10.0);
}

TEST_CASE("surface: rough metal mirrors the same sky where the bake left out finer mips of it") {
    if (!test::have_context()) {
        return;
    }
    const auto glow = [](const glm::vec3 &d) {
        return glm::vec3(1.0F + 8.0F * std::exp(6.0F * (d.y - 1.0F)));
    };
    LitSurface surface;
    surface.albedo = glm::vec3(0.0F);
    surface.metal = glm::vec4(1.0F);
    for (const float alpha : {0.05F, 0.2F, 0.6F}) {
        surface.alpha = alpha;
        surface.sky = test::float_cube(64, glow);
        surface.sky_blur = 5.0F;
        surface.trimmed_mips = 0.0F;
        const double whole = surface.seen().g;
        surface.sky = test::float_cube(16, glow);
        surface.sky_blur = 3.0F;
        surface.trimmed_mips = 2.0F;
        CHECK(surface.seen().g == test::within(whole, 0.02));
    }
}

TEST_CASE("surface: water takes the sun's light along the refracted ray, the sky's on a longer way than "
          "straight down") {
    if (!test::have_context()) {
        return;
    }
    LitSurface floor;
    floor.water = {0.4F, 0.2F, 0.05F, 0.0F};
    floor.place.y = -2.0F;
    for (const double degrees : {0.0, 40.0, 65.0}) {
        floor.to_sun = tilted(degrees);
        floor.sun = glm::vec3(static_cast<float>(M_PI));
        const double below = std::asin(std::sin(degrees * M_PI / 180.0) / 1.33);
        const glm::dvec3 seen = floor.seen();
        for (int i = 0; i < 3; ++i) {
            const double left = std::exp(-static_cast<double>(floor.water[i]) * 2.0 / std::cos(below));
            CHECK(seen[i] == test::within(left * std::cos(below), 0.01));
        }
    }
    floor.sun = glm::vec3(0.0F);
    floor.ambient = glm::vec3(1.0F);
    CHECK(floor.seen().r < std::exp(-0.4 * 2.0 * 1.05));
    CHECK(floor.seen().r > std::exp(-0.4 * 2.0 * 1.6));
}

TEST_CASE("surface: nothing jumps at the waterline, and nothing shines below it or in the view through it") {
    if (!test::have_context()) {
        return;
    }
    LitSurface sand;
    sand.water = {0.4F, 0.2F, 0.05F, 0.0F};
    sand.to_sun = tilted(60.0);
    sand.sun = glm::vec3(static_cast<float>(M_PI));
    sand.ambient = glm::vec3(0.3F);
    const auto seen = [&](float depth_m, float f0) {
        sand.place.y = -depth_m;
        sand.f0 = f0;
        return sand.seen().g;
    };
    CHECK(seen(1e-4F, 0.04F) == test::within(seen(-1e-4F, 0.04F), 0.002));
    CHECK(std::abs(seen(0.02F, 0.04F) - seen(0.02F, 0.0F)) > 1e-3); // it fades out over some centimetres
    CHECK(seen(0.15F, 0.04F) == doctest::Approx(seen(0.15F, 0.0F)));
    sand.refracting = 1.0F;
    CHECK(seen(0.02F, 0.04F) == doctest::Approx(seen(0.02F, 0.0F)));
}

TEST_CASE("surface: a lamp's light falls with the square of the distance, ends at its range and is finite "
          "within it") {
    if (!test::have_context()) {
        return;
    }
    LitSurface surface;
    surface.lamps.state.x = 1.0F;
    surface.lamps.color[0] = {static_cast<float>(M_PI), 1.0F, 1.0F, 0.1F};
    const auto lit_from = [&](float height_m, float range_m) {
        surface.lamps.place[0] = {0.0F, height_m, 0.0F, range_m};
        return surface.seen().r;
    };
    for (const float height_m : {0.5F, 1.0F, 3.0F}) {
        CHECK(lit_from(height_m, 1e4F) ==
              test::within(1.0 / std::pow(static_cast<double>(height_m), 2.0), 1e-3));
    }
    double before = lit_from(4.0F, 8.0F);
    CHECK(before > 0.8 / 16.0);
    for (float height_m = 4.5F; height_m < 8.0F; height_m += 0.5F) {
        const double now = lit_from(height_m, 8.0F);
        CHECK(now < before);
        before = now;
    }
    CHECK(lit_from(7.9F, 8.0F) < 0.01 / 62.0); // no edge is seen
    CHECK(lit_from(8.0F, 8.0F) == 0.0);
    CHECK(lit_from(0.02F, 1e4F) == test::within(100.0, 1e-3)); // inside of the lamp
    // From the side it lights by the cosine, and as a sun of the same irradiance does, highlights included.
    const glm::vec3 direction = glm::normalize(glm::vec3(1.0F, 1.0F, 0.5F));
    surface.f0 = 0.04F;
    surface.lamps.place[0] = glm::vec4(direction * 50.0F, 1e5F);
    surface.lamps.color[0] = {2500.0F, 2500.0F, 2500.0F, 0.01F};
    surface.place = {1.0F, 0.0F, 0.5F};
    surface.lamps.place[0] += glm::vec4(surface.place, 0.0F);
    const double by_lamp = surface.seen().g;
    surface.lamps.state.x = 0.0F;
    surface.sun = glm::vec3(1.0F);
    surface.to_sun = direction;
    CHECK(by_lamp == test::within(surface.seen().g, 0.005));
}

TEST_CASE("surface: water takes a lamp's light on its way down") {
    if (!test::have_context()) {
        return;
    }
    LitSurface floor;
    floor.lamps.state.x = 1.0F;
    floor.lamps.place[0] = {1.5F, 1.5F, 0.0F, 1e4F};
    floor.lamps.color[0] = {1.0F, 1.0F, 1.0F, 0.1F};
    floor.place.y = -2.0F;
    floor.water.w = 0.0F;
    const glm::dvec3 clear = floor.seen();
    floor.water = {0.4F, 0.2F, 0.05F, 0.0F};
    const glm::dvec3 seen = floor.seen();
    for (int i = 0; i < 3; ++i) {
        const double way_m = 2.0 * std::hypot(1.5, 3.5) / 3.5; // the straight one
        CHECK(seen[i] / clear[i] ==
              test::within(std::exp(-static_cast<double>(floor.water[i]) * way_m), 0.01));
    }
}
