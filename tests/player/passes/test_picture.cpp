#include "context.hpp"
#include "shader_probe.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

using namespace paradize;

namespace {

constexpr int picture_px = 64;

std::vector<float> plain_picture(float red, float green, float blue) {
    std::vector<float> out;
    for (int i = 0; i < picture_px * picture_px; ++i) {
        out.insert(out.end(), {red, green, blue, 1.0F});
    }
    return out;
}

/// One colour, as post.frag shows it.
class Shown {
  public:
    float exposure = 1.0F, glow = 0.0F, glow_strength = 0.0F;

    std::vector<double> greens(float light) {
        const gl::Texture picture =
            test::float_texture(picture_px, picture_px, plain_picture(light, light, light));
        const gl::Texture around = test::one_color(glow, glow, glow, 1.0F);
        gl::FrameUniforms frame = test::plain_frame(picture_px);
        frame.clock.z = exposure;
        probe_.set_frame(frame);
        probe_.set_texture("u_picture", 0, GL_TEXTURE_2D, picture);
        probe_.set_texture("u_glow", 1, GL_TEXTURE_2D, around);
        probe_.set("u_glow_strength", {glow_strength});
        const std::vector<float> pixels = probe_.draw();
        std::vector<double> out;
        for (std::size_t i = 0; i < pixels.size(); i += 4) {
            out.push_back(pixels[i + 1]);
        }
        return out;
    }
    /// Linear light of the display, the mean of all pixels.
    double of(float light) {
        double sum = 0.0;
        for (const double value : greens(light)) {
            sum += value / (picture_px * picture_px);
        }
        return sum <= 0.04045 ? sum / 12.92 : std::pow((sum + 0.055) / 1.055, 2.4); // IEC 61966-2-1
    }

  private:
    test::ShaderProbe probe_{picture_px, "fullscreen.vert", "post.frag"};
};

/// The tone map of H. Uchimura, 2017, with contrast 1.33 and the linear part from 0.22 to 40 % of the rest.
double uchimura(double x) {
    constexpr double most = 1.0, slope = 1.0, start = 0.22, length = 0.4, contrast = 1.33;
    const double l0 = (most - start) * length / slope;
    const double s0 = start + l0, s1 = start + slope * l0;
    const double t = std::clamp(x / start, 0.0, 1.0);
    const double toe_share = 1.0 - t * t * (3.0 - 2.0 * t), shoulder_share = x >= s0 ? 1.0 : 0.0;
    const double toe = start * std::pow(x / start, contrast);
    const double shoulder = most - (most - s1) * std::exp(-slope * most / (most - s1) * (x - s0) / most);
    return toe * toe_share + (start + slope * (x - start)) * (1.0 - toe_share - shoulder_share) +
           shoulder * shoulder_share;
}

/// The green of each pixel that a probe draws from a picture.
std::vector<double> green_of(test::ShaderProbe &probe, const std::vector<float> &pixels) {
    const gl::Texture source = test::float_texture(picture_px, picture_px, pixels);
    probe.set_texture("u_source", 0, GL_TEXTURE_2D, source);
    const std::vector<float> drawn = probe.draw();
    std::vector<double> out;
    for (std::size_t i = 0; i < drawn.size(); i += 4) {
        out.push_back(drawn[i + 1]);
    }
    return out;
}

/// glow.frag over a picture.
std::vector<double> glowing(const std::vector<float> &pixels, int downsample, float exposure) {
    test::ShaderProbe probe((picture_px + downsample - 1) / downsample, "fullscreen.vert", "glow.frag");
    probe.set_int("u_downsample", downsample);
    probe.set("u_exposure", {exposure});
    return green_of(probe, pixels);
}

/// glow_blur.frag over a picture.
std::vector<double> blurred_by(const std::vector<float> &pixels, float step_x, float step_y) {
    test::ShaderProbe probe(picture_px, "fullscreen.vert", "glow_blur.frag");
    probe.set("u_blur_step", {step_x, step_y});
    return green_of(probe, pixels);
}

} // namespace

TEST_CASE("picture: it shows light as the tone map's paper says, from black to white, twice as exposed half "
          "of it") {
    if (!test::have_context()) {
        return;
    }
    Shown shown;
    CHECK(std::abs(shown.of(0.0F)) < 1e-5);
    double before = -1.0;
    for (const float light :
         {0.005F, 0.02F, 0.1F, 0.2F, 0.25F, 0.4F, 0.52F, 0.55F, 0.8F, 1.5F, 3.0F, 10.0F}) {
        const double now = shown.of(light);
        CHECK(now > before);
        CHECK(now == test::within(uchimura(static_cast<double>(light)), 0.01));
        before = now;
    }
    shown.exposure = 2.0F;
    const std::vector<double> exposed = shown.greens(0.15F);
    shown.exposure = 1.0F;
    CHECK(exposed == shown.greens(0.3F));
    CHECK(shown.of(std::numeric_limits<float>::infinity()) == test::within(1.0, 0.002));
}

TEST_CASE("picture: glow is added to it before the tone map") {
    if (!test::have_context()) {
        return;
    }
    Shown shown;
    shown.glow = 0.4F;
    shown.glow_strength = 0.5F;
    const double with = shown.of(0.2F);
    shown.glow = 0.0F;
    CHECK(with == test::within(shown.of(0.4F), 1e-3));
    CHECK(with > 1.5 * shown.of(0.2F));
}

TEST_CASE("picture: dither spreads a level over its neighbours, and leaves the mean") {
    if (!test::have_context()) {
        return;
    }
    Shown shown;
    const std::vector<double> greens = shown.greens(0.3F);
    const double wanted = 255.0 * (1.055 * std::pow(0.3, 1.0 / 2.4) - 0.055);
    double mean = 0.0, squares = 0.0, most = 0.0;
    for (const double value : greens) {
        const double off = 255.0 * value - wanted; // levels of 8 bits
        mean += off / static_cast<double>(greens.size());
        squares += off * off / static_cast<double>(greens.size());
        most = std::max(most, std::abs(off));
    }
    CHECK(std::abs(mean) < 0.02);
    CHECK(most <= 0.51);
    CHECK(std::sqrt(squares) == test::within(0.5 / std::sqrt(6.0), 0.1)); // of a triangle
    // A colour between two levels of 8 bits is kept by their mean, to an eighth of a level.
    for (const double level : {150.1, 150.25, 150.4, 150.6, 150.75}) {
        const auto light = static_cast<float>(std::pow((level / 255.0 + 0.055) / 1.055, 2.4));
        double shown_levels = 0.0;
        for (const double value : shown.greens(light)) {
            shown_levels += std::round(255.0 * value) / static_cast<double>(greens.size());
        }
        CHECK(std::abs(shown_levels - level) < 0.14);
    }
}

TEST_CASE("glow: what is brighter than 0.9 glows, in its colour, by as much as it is brighter") {
    if (!test::have_context()) {
        return;
    }
    CHECK(glowing(plain_picture(0.89F, 0.89F, 0.89F), 4, 1.0F)[0] == 0.0);
    CHECK(glowing(plain_picture(2.0F, 2.0F, 2.0F), 4, 1.0F)[0] == doctest::Approx(1.1));
    CHECK(glowing(plain_picture(1.0F, 1.0F, 1.0F), 4, 2.0F)[0] == doctest::Approx(1.1));
    CHECK(glowing(plain_picture(0.89F, 0.89F, 0.89F), 4, 0.9F)[0] == 0.0);
    for (const double edge : glowing(plain_picture(2.0F, 2.0F, 2.0F), 6, 1.0F)) {
        CHECK(edge == doctest::Approx(1.1)); // also where the last texels reach over the picture's end
    }
    // Green alone: of a luminance of 1.4304.
    CHECK(glowing(plain_picture(0.0F, 2.0F, 0.0F), 4, 1.0F)[0] == test::within(2.0 * 0.5304 / 1.4304, 1e-3));
    // A single bright pixel of sixteen glows less than a sixteenth of its light, so that it does not flicker.
    std::vector<float> firefly = plain_picture(0.0F, 0.0F, 0.0F);
    firefly[0] = firefly[1] = firefly[2] = 1000.0F;
    const std::vector<double> glow = glowing(firefly, 4, 1.0F);
    CHECK(glow[0] > 0.0);
    CHECK(glow[0] < 0.1);
    CHECK(glow[1] == 0.0);
}

TEST_CASE("glow: its blur keeps the light, and falls alike to both sides") {
    if (!test::have_context()) {
        return;
    }
    std::vector<float> point = plain_picture(0.0F, 0.0F, 0.0F);
    constexpr std::size_t middle = std::size_t{picture_px} * 32 + 32;
    point[4 * middle + 1] = 1.0F;
    for (const std::size_t stride : {std::size_t{1}, std::size_t{picture_px}}) { // along x, along y
        const float step = 1.0F / picture_px;
        const std::vector<double> blurred =
            blurred_by(point, stride == 1 ? step : 0.0F, stride == 1 ? 0.0F : step);
        double sum = 0.0;
        for (const double value : blurred) {
            sum += value;
        }
        CHECK(sum == test::within(1.0, 1e-3));
        for (std::size_t i = 1; i <= 6; ++i) {
            CHECK(blurred[middle + i * stride] == test::within(blurred[middle - i * stride], 0.01));
            CHECK(blurred[middle + i * stride] < blurred[middle + (i - 1) * stride]);
        }
        CHECK(blurred[middle + 6 * stride] > 0.0);
        CHECK(blurred[middle + 6 * stride] < 0.1 * blurred[middle]); // no edge is seen
    }
}

TEST_CASE("resolve: its tone map is reversed exactly, rises with light, and is close to the picture's") {
    if (!test::have_context()) {
        return;
    }
    test::ShaderProbe probe(
        picture_px, "#include \"lib/tonemap.glsl\"\nout vec4 color;\nvoid main() {\n"
                    "float x = exp2((floor(gl_FragCoord.y) * 64.0 + gl_FragCoord.x) / 128.0 - 18.0);\n"
                    "vec3 mapped = reversible_tone_map(vec3(x));\n"
                    "color = vec4(x, mapped.g, reversed_tone_map(mapped).g, 1.0); }\n");
    const std::vector<float> pixels = probe.draw();
    double before = 0.0;
    for (std::size_t i = 0; i < pixels.size(); i += 4) {
        const double x = pixels[i], mapped = pixels[i + 1];
        CHECK(mapped > before);
        CHECK(pixels[i + 2] == test::within(x, 0.002));
        if (x > 0.22 && x < 2.5) {
            CHECK(mapped == test::within(uchimura(x), 0.001));
        }
        before = mapped;
    }
}

TEST_CASE("shafts: the air scatters all light somewhere, and looks at each of its sixteen places once") {
    if (!test::have_context()) {
        return;
    }
    test::ShaderProbe probe(picture_px, test::covering_vertex,
                            "#define main march\n#include \"shafts_march.frag\"\n#undef main\nvoid main() {\n"
                            "fragment = vec4(phase(gl_FragCoord.x / 32.0 - 1.0), "
                            "ordered(ivec2(gl_FragCoord.xy)), 0.0, 1.0); }\n");
    for (const float anisotropy : {0.0F, 0.4F, 0.7F}) {
        probe.set("u_anisotropy", {anisotropy});
        const std::vector<float> pixels = probe.draw();
        double all = 0.0;
        for (std::size_t i = 0; i < picture_px; ++i) {
            all += pixels[4 * i] * 2.0 * M_PI / 32.0; // over cosines from -1 to 1
        }
        CHECK(all == test::within(1.0, 0.01));
        CHECK(pixels[4 * 63] >= pixels[0]); // forwards
    }
    const std::vector<float> pixels = probe.draw();
    std::array<int, 16> seen{};
    for (std::size_t y = 4; y < 8; ++y) {
        for (std::size_t x = 8; x < 12; ++x) {
            const float place = pixels[4 * (y * picture_px + x) + 1];
            CHECK(place > 0.0F);
            CHECK(place < 1.0F);
            ++seen.at(static_cast<std::size_t>(place * 16.0F));
        }
    }
    CHECK(std::ranges::count(seen, 1) == 16);
}
