// Sizes and qualities of one renderer, one after another.

#include "context.hpp"
#include "gl/shader_library.hpp"
#include "render/renderer.hpp"
#include "small_scene.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include <cstdint>
#include <vector>

using namespace paradize;
using paradize::test::SmallScene;

namespace {

std::vector<std::uint8_t> picture(Renderer &renderer, const assets::Flight &flight) {
    renderer.draw(1.0, flight_pose(flight, 1.0));
    std::vector<std::uint8_t> pixels;
    renderer.read_picture(pixels);
    return pixels;
}

/// Of one scene.
struct SharedByRenderers {
    SmallScene small;
    Streamer streamer = small.streamer();
    Scene scene{small.file, streamer};
    gl::ShaderLibrary shaders{gl::ShaderLibrary::find()};
};

} // namespace

TEST_CASE("renderer: depth tested late gives the same picture, and leaves the state as it was") {
    if (!test::have_context()) {
        return;
    }
    SharedByRenderers shared;
    auto &[small, streamer, scene, shaders] = shared;
    RenderSettings settings = render_settings(small.file, all_at(Tier::balanced), Device());
    Renderer early(scene, shaders, {64, 36, settings, {}});
    settings.late_depth_test = true;
    Renderer late(scene, shaders, {64, 36, settings, {}});
    CHECK(picture(late, small.file.flight) == picture(early, small.file.flight));
    CHECK_FALSE(glIsEnabled(GL_STENCIL_TEST));
    CHECK_FALSE(glIsEnabled(GL_SAMPLE_ALPHA_TO_COVERAGE));
    test::throw_on_error();
}

TEST_CASE("renderer: after other sizes and qualities a picture is that of a new renderer") {
    if (!test::have_context()) {
        return;
    }
    SharedByRenderers shared;
    auto &[small, streamer, scene, shaders] = shared;
    Quality quality = all_at(Tier::balanced);
    const RenderSettings whole = render_settings(small.file, quality, Device());
    quality[static_cast<std::size_t>(QualityFeature::resolution)] = Tier::fast;
    const RenderSettings half = render_settings(small.file, quality, Device());
    struct Step {
        RenderSettings settings;
        int width_px, height_px;
    };
    Renderer kept(scene, shaders, {64, 36, whole, {}});
    for (const Step &step : {Step{half, 64, 36}, Step{half, 37, 23}, Step{whole, 37, 23}, Step{half, 37, 23},
                             Step{half, 1, 1}, Step{whole, 64, 36}}) {
        kept.resize(step.width_px, step.height_px);
        kept.change_settings(step.settings);
        Renderer fresh(scene, shaders, {step.width_px, step.height_px, step.settings, {}});
        const std::vector<std::uint8_t> pixels = picture(kept, small.file.flight);
        CHECK(pixels.size() == static_cast<std::size_t>(3 * step.width_px * step.height_px));
        CHECK(pixels == picture(fresh, small.file.flight));
        CHECK_FALSE(kept.find_bad_pixel());
    }
    test::throw_on_error();
}
