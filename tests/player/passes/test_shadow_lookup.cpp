#include "context.hpp"
#include "gl/texture.hpp"
#include "shader_probe.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>
#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

using namespace paradize;

namespace {

constexpr int layer_px = 64, looks = 64;
constexpr double square_m = 8.0, range_m = 20.0, texel_m = square_m / layer_px;

const std::string shadow_text =
    "#include \"lib/shadow.glsl\"\nuniform vec3 u_first;\nuniform vec3 u_last;\nuniform float u_distance_m;\n"
    "out vec4 color;\nvoid main() {\nvec3 at = mix(u_first, u_last, gl_FragCoord.x / 64.0);\n"
    "color = vec4(sun_visibility(at, vec3(0.0, 1.0, 0.0), u_distance_m)); }\n";

/// A shadow map around the origin, and how much of the sun is seen from places of the ground y = 0.
class ShadowedGround {
  public:
    float penumbra_m = 0.1F, blur_m = 100.0F, eye_distance_m = 5.0F, pixels_per_rad = 1000.0F;
    float sun_radius_rad = 0.02F;
    float eye_angle_rad = 0.0F; // of the eye from the vertical, towards -X
    bool has_map = true;
    std::array<glm::vec4, 3> cascades{{{1.0F, 0.0F, 0.0F, texel_m}, {}, {}}};

    /// defines: SHADOW_FILTER and SHADOW_CASCADES.
    explicit ShadowedGround(std::string_view filter, double sun_elevation_rad = 0.5 * M_PI, int layers = 1)
        : to_sun_(std::cos(sun_elevation_rad), std::sin(sun_elevation_rad), 0.0),
          up_(-std::sin(sun_elevation_rad), std::cos(sun_elevation_rad), 0.0), count_(layers),
          layers_(gl::make_depth_comparison_layers(layer_px, layers)),
          nearest_(gl::make_sampler(gl::Wrap::clamp, gl::Filter::nearest)),
          probe_(looks, test::covering_vertex, shadow_text,
                 {filter, layers > 1 ? "SHADOW_CASCADES 3" : "SHADOW_CASCADES 1"}) {}

    /// Fills a layer: the height over the ground of what the sun sees, along its rays, by place in the map's
    /// plane, m (up the map, and -Z to +Z).
    void cast(int layer, const std::function<double(double, double)> &height_m) {
        std::vector<float> depths;
        for (int row = 0; row < layer_px; ++row) {
            for (int column = 0; column < layer_px; ++column) {
                const auto at = [](int i) { return (i + 0.5) * texel_m - 0.5 * square_m; };
                depths.push_back(
                    static_cast<float>(ground_depth(at(column)) - height_m(at(column), at(row)) / range_m));
            }
        }
        glBindTexture(GL_TEXTURE_2D_ARRAY, layers_.name());
        glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, layer, layer_px, layer_px, 1, GL_DEPTH_COMPONENT,
                        GL_FLOAT, depths.data());
    }
    /// Share of the sun from places between x = first and x = last.
    std::vector<double> between(float first, float last, float y = 0.0F) {
        gl::FrameUniforms frame = test::plain_frame(looks);
        glm::mat4 to_map(0.0F); // columns
        for (int i = 0; i < 3; ++i) {
            to_map[i][0] = static_cast<float>(up_[i] / square_m);
            to_map[i][1] = static_cast<float>((i == 2 ? 1.0 : 0.0) / square_m);
            to_map[i][2] = static_cast<float>(-to_sun_[i] / range_m);
        }
        to_map[3] = glm::vec4(0.5F, 0.5F, 0.5F, 1.0F);
        frame.shadow_from_world = to_map;
        frame.sun_direction = glm::vec4(glm::vec3(to_sun_), sun_radius_rad);
        frame.sun_radiance = {1.0F, 1.0F, 1.0F, has_map ? 1.0F : 0.0F};
        frame.eye = {-eye_distance_m * std::sin(eye_angle_rad), eye_distance_m * std::cos(eye_angle_rad),
                     0.0F, 1.0F};
        frame.lens.z = pixels_per_rad;
        probe_.set_frame(frame);
        probe_.set_texture("u_shadow_map", 0, GL_TEXTURE_2D_ARRAY, layers_);
        probe_.set_texture("u_shadow_depth", 1, GL_TEXTURE_2D_ARRAY, layers_);
        gl::bind_texture(1, GL_TEXTURE_2D_ARRAY, layers_.name(), nearest_.name());
        glUniform4fv(probe_.use().location("u_shadow_cascades"), count_, &cascades[0].x);
        probe_.set("u_shadow_texel", {1.0F / layer_px});
        probe_.set("u_shadow_penumbra_m", {penumbra_m});
        probe_.set("u_shadow_blur_m", {blur_m});
        probe_.set("u_shadow_range_m", {static_cast<float>(range_m)});
        probe_.set("u_first", {first, y, 0.0F});
        probe_.set("u_last", {last, y, 0.0F});
        probe_.set("u_distance_m", {eye_distance_m});
        const std::vector<float> pixels = probe_.draw();
        gl::bind_texture(1, GL_TEXTURE_2D_ARRAY, layers_.name());
        std::vector<double> out;
        for (std::size_t i = 0; i < looks; ++i) {
            out.push_back(pixels[4 * i]);
        }
        return out;
    }
    double at(float x, float y = 0.0F) { return between(x, x, y)[0]; }

  private:
    double ground_depth(double along) const { // of the ground at a place up the map
        return 0.5 + along * to_sun_.x / to_sun_.y / range_m;
    }

    glm::dvec3 to_sun_, up_;
    int count_;
    gl::Texture layers_;
    gl::Sampler nearest_;
    test::ShaderProbe probe_;
};

/// Width over which the sun comes out behind a straight edge, from a tenth to nine tenths, m.
double soft_edge_m(const std::vector<double> &line, double pixel_m) {
    return static_cast<double>(
               std::ranges::count_if(line, [](double lit) { return lit > 0.1 && lit < 0.9; })) *
           pixel_m;
}

const std::array<std::string_view, 4> shadow_filters{"SHADOW_FILTER 0", "SHADOW_FILTER 1", "SHADOW_FILTER 2",
                                                     "SHADOW_FILTER 3"};

double flat(double, double) {
    return 0.0;
}

/// A roof over the half of the ground with x < 0.
std::function<double(double, double)> roof(double height_m) {
    return [=](double along, double) { return along > 0.0 ? height_m : 0.0; };
}

} // namespace

TEST_CASE("shadow: under a roof it is dark, beside it light, with the edge where the roof ends") {
    if (!test::have_context()) {
        return;
    }
    for (const std::string_view filter : shadow_filters) {
        ShadowedGround ground(filter);
        ground.cast(0, roof(2.0));
        const std::vector<double> line = ground.between(-1.0F, 1.0F);
        CHECK(line.front() == 0.0);
        CHECK(line.back() == 1.0);
        for (std::size_t i = 1; i < line.size(); ++i) {
            CHECK(line[i] >= line[i - 1]);
        }
        double lit_m = 0.0;
        for (const double lit : line) {
            lit_m += lit * 2.0 / looks;
        }
        CHECK(std::abs(lit_m - 1.0) < 0.6 * texel_m);
        ground.has_map = false;
        CHECK(ground.at(-1.0F) == 1.0);
    }
}

TEST_CASE("shadow: beside the map, above and below its range all is lit, and its border is no edge") {
    if (!test::have_context()) {
        return;
    }
    for (const std::string_view filter : shadow_filters) {
        ShadowedGround ground(filter);
        ground.cast(0, [](double, double) { return 5.0; }); // a roof over all
        CHECK(ground.at(0.0F) == 0.0);
        CHECK(ground.at(4.1F) == 1.0);
        CHECK(ground.at(-4.1F) == 1.0);
        CHECK(ground.at(0.0F, 10.5F) == 1.0);
        CHECK(ground.at(0.0F, -10.5F) == 1.0);
        CHECK(ground.at(0.0F, -9.5F) == 0.0);
        const std::vector<double> line = ground.between(3.6F, 4.1F);
        for (std::size_t i = 1; i < line.size(); ++i) {
            CHECK(line[i] >= line[i - 1]);
            CHECK(line[i] - line[i - 1] < 0.1);
        }
    }
}

TEST_CASE(
    "shadow: nothing shades itself, however low the sun, and what lies two texels high casts a shadow") {
    if (!test::have_context()) {
        return;
    }
    for (const std::string_view filter : {shadow_filters[0], shadow_filters[1]}) {
        for (const double degrees : {12.0, 30.0, 60.0, 90.0}) {
            const double elevation = degrees * M_PI / 180.0;
            ShadowedGround ground(filter, elevation);
            // As the light's view draws it: polygon offset adds one and a half of the texel's slope.
            const double bias_m = 1.5 * texel_m / std::tan(elevation);
            ground.cast(0, [&](double, double) { return -bias_m; });
            for (const float penumbra_m : {0.1F, 0.3F}) {
                ground.penumbra_m = penumbra_m;
                for (const double lit : ground.between(-2.0F, 2.0F)) {
                    CHECK(lit > 0.99);
                }
            }
        }
        ShadowedGround ground(filter);
        ground.cast(0, roof(2.0 * texel_m));
        CHECK(ground.at(-1.0F) == 0.0);
    }
}

TEST_CASE("shadow: edges are as soft as the penumbra near the eye, and far away as a pixel is wide") {
    if (!test::have_context()) {
        return;
    }
    ShadowedGround ground("SHADOW_FILTER 1");
    ground.cast(0, roof(2.0));
    const auto edge_at = [&](float penumbra_m, float distance_m, float pixels_per_rad) {
        ground.penumbra_m = penumbra_m;
        ground.eye_distance_m = distance_m;
        ground.pixels_per_rad = pixels_per_rad;
        return soft_edge_m(ground.between(-1.0F, 1.0F), 2.0 / looks);
    };
    const double narrow = edge_at(0.0F, 5.0F, 1e4F), medium = edge_at(0.2F, 5.0F, 1e4F),
                 wide = edge_at(0.4F, 5.0F, 1e4F);
    CHECK(narrow < 2.5 * texel_m);
    CHECK(medium > 1.2 * narrow);
    CHECK(wide == test::within(2.0 * medium, 0.25));
    CHECK(wide > 0.4); // nine tenths of a disc of 0.8 m lie in the middle 0.64 m of its width
    CHECK(wide < 0.8);
    ground.blur_m = 20.0F;
    CHECK(edge_at(0.4F, 19.9F, 1e4F) == test::within(narrow, 0.3));
    CHECK(edge_at(0.4F, 11.9F, 1e4F) == doctest::Approx(wide));
    CHECK(edge_at(0.0F, 50.0F, 1e4F) < 2.5 * texel_m);
    CHECK(edge_at(0.0F, 50.0F, 100.0F) > 1.5 * narrow); // a pixel of half a metre
    // Seen from low above the ground, it is longer, and holds what lies along it.
    const double from_above = edge_at(0.0F, 20.0F, 200.0F); // 0.1 m
    ground.eye_angle_rad = 1.4F;                            // 0.59 m
    CHECK(edge_at(0.0F, 20.0F, 200.0F) > 1.7 * from_above);
    CHECK(edge_at(0.0F, 20.0F, 200.0F) < 0.7);
}

TEST_CASE("shadow: with penumbras, edges are as wide as the sun seen from under the roof's edge") {
    if (!test::have_context()) {
        return;
    }
    ShadowedGround ground("SHADOW_FILTER 2");
    ground.sun_radius_rad = 0.05F;
    for (const double height_m : {4.0, 8.0}) {
        ground.cast(0, roof(height_m));
        const double sun_m = 2.0 * height_m * std::tan(0.05); // width of its disc
        // A tenth to nine tenths of a disc's light lie within 0.69 of its width.
        CHECK(soft_edge_m(ground.between(-1.0F, 1.0F), 2.0 / looks) == test::within(0.69 * sun_m, 0.25));
        CHECK(ground.at(static_cast<float>(0.6 * sun_m)) ==
              1.0); // roof in the search, but not before the sun
    }
    ground.cast(0, roof(0.5));
    CHECK(soft_edge_m(ground.between(-1.0F, 1.0F), 2.0 / looks) < 2.5 * texel_m);
}

TEST_CASE(
    "shadow: the finest cascade that holds a place decides, and a coarser one takes over without an edge") {
    if (!test::have_context()) {
        return;
    }
    ShadowedGround ground("SHADOW_FILTER 1", 0.5 * M_PI, 3);
    // The middle 4 m, and the middle 2 m, along x; along z somewhat beside it.
    ground.cascades = {
        {{1.0F, 0.0F, 0.0F, texel_m}, {2.0F, -0.5F, -0.4F, texel_m / 2}, {4.0F, -1.5F, -1.3F, texel_m / 4}}};
    ground.cast(0, flat);
    ground.cast(1, flat);
    ground.cast(2, [](double, double) { return 2.0; });
    ground.eye_distance_m = 1.0F;
    CHECK(ground.at(0.0F) == 0.0);
    CHECK(ground.at(0.75F) == 0.0);
    CHECK(ground.at(1.0F) == 1.0);
    CHECK(ground.at(-1.0F) == 1.0);
    const std::vector<double> line = ground.between(0.7F, 1.1F);
    for (std::size_t i = 1; i < line.size(); ++i) {
        CHECK(line[i] >= line[i - 1]);
        CHECK(line[i] - line[i - 1] < 0.35); // taps change over one by one
    }
    ground.cast(1, [](double, double) { return 2.0; });
    CHECK(ground.at(1.5F) == 0.0);
    CHECK(ground.at(2.0F) == 1.0);
    // Edges are as soft where two of them share the taps.
    ground.penumbra_m = 0.2F;
    const auto edge_at = [&](double x) { // of a roof over the places before it
        ground.cast(0, [=](double along, double) { return along > -x ? 2.0 : 0.0; });
        ground.cast(1, [=](double along, double) { return 0.5 * along > -x ? 2.0 : 0.0; });
        const auto middle = static_cast<float>(x);
        return soft_edge_m(ground.between(middle - 0.5F, middle + 0.5F), 1.0 / looks);
    };
    CHECK(edge_at(1.65) < 1.2 * edge_at(1.3));
    // From so far that a pixel holds many texels of them, the coarsest is read.
    ground.cast(0, flat);
    ground.eye_distance_m = 500.0F;
    CHECK(ground.at(-0.5F) == 1.0);
}
