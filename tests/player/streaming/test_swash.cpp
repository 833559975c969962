#include "context.hpp"
#include "shader_probe.hpp"
#include "streaming/terrain_tiles.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <vector>

using namespace paradize;

TEST_CASE("swash: no wave of the shader wets sand above the height from which on patches count as dry") {
    if (!test::have_context()) {
        return;
    }
    test::ShaderProbe probe(64,
                            "#include \"lib/guard.glsl\"\n#include \"lib/swash.glsl\"\n"
                            "uniform float u_height;\nout vec4 color;\nvoid main() {\n"
                            "Swash s = swash_at(1.7 * gl_FragCoord.xy, u_height * u_swash.x, 1e-3, 1e-2);\n"
                            "color = vec4(max(s.sheet, 0.0), s.film, s.foam, 1.0); }\n");
    const gl::Program &program = probe.use();
    const auto is_wet = [&](double height) { // in run-ups, at any place and moment
        glUniform1f(program.location("u_height"), static_cast<float>(height));
        bool wet = false;
        for (int wave = 0; wave < 30 && !wet; ++wave) {
            for (const float phase : {0.0F, 0.25F, 0.5F, 0.75F}) {
                glUniform4f(program.location("u_swash"), 0.5F, static_cast<float>(wave), phase, 30.0F);
                const std::vector<float> pixels = probe.draw();
                for (std::size_t i = 0; i < pixels.size(); i += 4) {
                    wet = wet || *std::max_element(&pixels[i], &pixels[i + 3]) > 0.0F;
                }
            }
        }
        return wet;
    };
    CHECK_FALSE(is_wet(highest_run_up));
    CHECK(is_wet(0.8 * highest_run_up));
}
