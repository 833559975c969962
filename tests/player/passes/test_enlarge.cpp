#include "context.hpp"
#include "shader_probe.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include <cmath>
#include <cstddef>
#include <functional>
#include <vector>

using namespace paradize;

namespace {

constexpr int enlarged_px = 60; // of a picture with 40 texels along the axis

/// A row, or a column, enlarged from 40 texels to 60 pixels; value: of each texel.
std::vector<double> enlarged(bool across, const std::function<float(int)> &value) {
    test::ShaderProbe probe(enlarged_px, "fullscreen.vert", "enlarge.frag");
    constexpr int texels = 40;
    const int width = across ? texels : enlarged_px, height = across ? enlarged_px : texels;
    std::vector<float> pixels;
    for (int row = 0; row < height; ++row) {
        for (int column = 0; column < width; ++column) {
            pixels.insert(pixels.end(), {value(across ? column : row), 0.0F, 0.0F, 1.0F});
        }
    }
    const gl::Texture picture = test::float_texture(width, height, pixels);
    probe.set_texture("u_picture", 0, GL_TEXTURE_2D, picture);
    probe.set("u_along", {across ? 1.0F : 0.0F, across ? 0.0F : 1.0F});
    probe.set("u_texels", {40.0F / enlarged_px});
    const std::vector<float> drawn = probe.draw();
    std::vector<double> out;
    for (std::size_t i = 0; i < enlarged_px; ++i) {
        const std::size_t at = across ? 30 * enlarged_px + i : i * enlarged_px + 30;
        out.push_back(drawn[4 * at]);
    }
    return out;
}

} // namespace

TEST_CASE("enlarge: slopes stay straight and where they are, edges have no rings, along both axes") {
    if (!test::have_context()) {
        return;
    }
    for (const bool across : {true, false}) {
        const auto slope = enlarged(across, [](int i) { return static_cast<float>(i) + 0.5F; });
        for (std::size_t i = 3; i < enlarged_px - 3; ++i) {
            CHECK(slope[i] == test::within((static_cast<double>(i) + 0.5) * 40.0 / enlarged_px, 1e-4));
        }
        const auto edge = enlarged(across, [](int i) { return i < 20 ? 0.2F : 0.8F; });
        for (std::size_t i = 1; i < enlarged_px; ++i) {
            CHECK(edge[i] >= edge[i - 1] - 1e-6);
            CHECK(edge[i] <= 0.8001);
        }
        CHECK(edge[0] == doctest::Approx(0.2));
        // Sharper than a straight line from texel to texel: a wave keeps more of its height.
        const auto wave =
            enlarged(across, [](int i) { return static_cast<float>(std::sin(0.8 * (i + 0.5))); });
        double squares = 0.0, straight = 0.0;
        for (std::size_t i = 6; i < enlarged_px - 6; ++i) {
            const double place = (static_cast<double>(i) + 0.5) * 40.0 / enlarged_px - 0.5,
                         base = std::floor(place);
            const double wanted = std::sin(0.8 * (place + 0.5));
            const double line =
                std::lerp(std::sin(0.8 * (base + 0.5)), std::sin(0.8 * (base + 1.5)), place - base);
            squares += (wave[i] - wanted) * (wave[i] - wanted);
            straight += (line - wanted) * (line - wanted);
        }
        CHECK(squares < 0.6 * straight);
    }
}
