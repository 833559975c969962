#include "context.hpp"
#include "shader_probe.hpp"
#include "streaming/terrain_tiles.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

using namespace paradize;

namespace {

const std::string one_wave = "swash_of(u_swash.y, u_swash.z, 1.7 * gl_FragCoord.xy,";
constexpr float run_up_m = 0.5F, waves = 30.0F; // in a loop

/// The swash over a square of 100 m, at one height.
class Shore {
  public:
    struct Place {
        float sheet_m, film, foam;
    };
    /// swash: the function to call, up to its argument for the height.
    explicit Shore(const std::string &swash = "swash_at(1.7 * gl_FragCoord.xy,")
        : probe_(64, "#include \"lib/guard.glsl\"\n#include \"lib/swash.glsl\"\n"
                     "uniform float u_height;\nout vec4 color;\nvoid main() {\n"
                     "Swash s = " +
                         swash +
                         " u_height * u_swash.x, 1e-3, 1e-2);\n"
                         "color = vec4(s.sheet, s.film, s.foam, 1.0); }\n") {}
    /// height: above calm water, in run-ups. phase: of the wave, [0, 1).
    std::vector<Place> at(float height, int wave, float phase) {
        const gl::Program &program = probe_.use();
        glUniform1f(program.location("u_height"), height);
        glUniform4f(program.location("u_swash"), run_up_m, static_cast<float>(wave), phase, waves);
        const std::vector<float> pixels = probe_.draw();
        std::vector<Place> out;
        for (std::size_t i = 0; i < pixels.size(); i += 4) {
            out.push_back({pixels[i], pixels[i + 1], pixels[i + 2]});
        }
        return out;
    }

  private:
    test::ShaderProbe probe_;
};

} // namespace

TEST_CASE("swash: no wave of the shader wets sand above the height from which on patches count as dry") {
    if (!test::have_context()) {
        return;
    }
    Shore shore;
    const auto is_wet = [&](double height) { // in run-ups, at any place and moment
        bool wet = false;
        for (int wave = 0; wave < 30 && !wet; ++wave) {
            for (const float phase : {0.0F, 0.25F, 0.5F, 0.75F}) {
                for (const Shore::Place &place : shore.at(static_cast<float>(height), wave, phase)) {
                    wet = wet || place.sheet_m > 0.0F || place.film > 0.0F || place.foam > 0.0F;
                }
            }
        }
        return wet;
    };
    CHECK_FALSE(is_wet(highest_run_up));
    CHECK(is_wet(0.8 * highest_run_up));
}

namespace {

/// The largest differences between two moments.
Shore::Place largest_step(const std::vector<Shore::Place> &before, const std::vector<Shore::Place> &after) {
    Shore::Place most{};
    for (std::size_t i = 0; i < before.size(); ++i) {
        most.sheet_m = std::max(most.sheet_m, std::abs(after[i].sheet_m - before[i].sheet_m));
        most.film = std::max(most.film, std::abs(after[i].film - before[i].film));
        most.foam = std::max(most.foam, std::abs(after[i].foam - before[i].foam));
    }
    return most;
}

} // namespace

TEST_CASE("swash: the waves of a loop come again, the last one before the first") {
    if (!test::have_context()) {
        return;
    }
    Shore shore;
    for (const float phase : {0.1F, 0.45F, 0.9F}) {
        const auto first = shore.at(0.3F, 0, phase), again = shore.at(0.3F, static_cast<int>(waves), phase);
        CHECK(largest_step(first, again).sheet_m == 0.0F);
        CHECK(largest_step(first, again).film == 0.0F);
        CHECK(largest_step(first, again).foam == 0.0F);
        CHECK(largest_step(first, shore.at(0.3F, 1, phase)).sheet_m > 0.0F);
    }
}

TEST_CASE(
    "swash: nothing jumps where a wave gives way to the next, and sand is still wet of the one before") {
    if (!test::have_context()) {
        return;
    }
    Shore shore(one_wave);
    float wettest = 0.0F;
    for (const float height : {-1.0F, -0.2F, 0.1F, 0.4F, 0.7F}) {
        for (int wave = 0; wave < 8; ++wave) {
            const auto before = shore.at(height, wave, 1.0F), after = shore.at(height, wave + 1, 0.0F);
            const Shore::Place step = largest_step(before, after);
            CHECK(step.film < 0.002F);
            CHECK(step.foam < 1e-5F);
            CHECK(step.sheet_m < 1e-6F);
            if (height > 0.0F) {
                wettest = std::max(wettest, std::ranges::max(after, {}, &Shore::Place::film).film);
            }
        }
    }
    CHECK(wettest > 0.3F);
}

TEST_CASE("swash: foam stays on the sand where a wave turned, and dissolves before the next one breaks") {
    if (!test::have_context()) {
        return;
    }
    Shore shore(one_wave);
    const auto foam_above_sheet = [&](float phase) { // its mean
        double foam = 0.0;
        std::size_t places = 0;
        for (float height = 0.1F; height < 1.2F; height += 0.05F) {
            for (int wave = 0; wave < 4; ++wave) {
                for (const Shore::Place &place : shore.at(height, wave, phase)) {
                    foam += place.sheet_m < 0.0F ? static_cast<double>(place.foam) : 0.0;
                    places += place.sheet_m < 0.0F ? 1 : 0;
                }
            }
        }
        return foam / static_cast<double>(places);
    };
    CHECK(foam_above_sheet(0.2F) < 1e-5); // it still rises
    CHECK(foam_above_sheet(0.4F) > 1e-3);
    CHECK(foam_above_sheet(0.5F) > 1e-3);
    CHECK(foam_above_sheet(0.75F) < 1e-5);
}
