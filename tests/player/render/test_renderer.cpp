// Sizes and qualities of one renderer, one after another.

#include "context.hpp"
#include "gl/framebuffer.hpp"
#include "gl/shader_library.hpp"
#include "gl/texture.hpp"
#include "passes/frame.hpp"
#include "passes/pass.hpp"
#include "render/renderer.hpp"
#include "scene/camera.hpp"
#include "small_scene.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <utility>
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

/// The small scene at a sea that mirrors it.
struct SmallSea : SmallScene {
    SmallSea() {
        assets::Water &water = file.water.emplace();
        water.normal = water.dudv = "quad_color";
        water.size_m = 200.0F;
        water.wave_height_m = 0.2F;
        file.refraction_scale = 0.5F;
    }
};

/// Notes the clip distance and the winding of the view that it draws.
struct NotesState : Pass {
    bool clips = false, turned = false;
    void draw(const Frame & /*frame*/, const View & /*view*/) override {
        clips = glIsEnabled(GL_CLIP_DISTANCE0) == GL_TRUE;
        GLint winding = 0;
        glGetIntegerv(GL_FRONT_FACE, &winding);
        turned = winding == GL_CW;
    }
};

/// Of one scene.
template <class Scenery = SmallScene>
struct SharedByRenderers {
    Scenery small;
    Streamer streamer = small.streamer();
    Scene scene{small.file, streamer};
    gl::ShaderLibrary shaders{gl::ShaderLibrary::find()};
};

} // namespace

TEST_CASE("renderer: depth tested late gives the same picture, and leaves the state as it was") {
    if (!test::have_context()) {
        return;
    }
    SharedByRenderers<> shared;
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
    SharedByRenderers<> shared;
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

TEST_CASE("renderer: after other qualities of mirror, waves and edges a picture is that of a new renderer") {
    if (!test::have_context()) {
        return;
    }
    SharedByRenderers<SmallSea> shared;
    auto &[small, streamer, scene, shaders] = shared;
    streamer.upload({});
    const auto fast = [&](std::initializer_list<QualityFeature> features) {
        Quality quality = all_at(Tier::balanced);
        for (const QualityFeature feature : features) {
            quality[static_cast<std::size_t>(feature)] = Tier::fast;
        }
        return render_settings(small.file, quality, Device());
    };
    const RenderSettings balanced = fast({});
    Renderer kept(scene, shaders, {64, 36, balanced, {}});
    std::vector<std::uint8_t> before = picture(kept, small.file.flight);
    for (const RenderSettings &settings :
         {fast({QualityFeature::lod}), balanced,
          fast({QualityFeature::reflection, QualityFeature::refraction}), fast({QualityFeature::shadow})}) {
        kept.change_settings(settings);
        Renderer fresh(scene, shaders, {64, 36, settings, {}});
        const std::vector<std::uint8_t> pixels = picture(kept, small.file.flight);
        CHECK(pixels == picture(fresh, small.file.flight));
        CHECK(pixels != before);
        before = pixels;
    }
    test::throw_on_error();
}

TEST_CASE("frame: while a view is drawn it clips, and mirrors turn triangles round, as the view says") {
    if (!test::have_context()) {
        return;
    }
    SharedByRenderers<> shared;
    std::vector<std::unique_ptr<Pass>> passes;
    passes.push_back(std::make_unique<NotesState>());
    const auto &state = static_cast<const NotesState &>(*passes[0]);
    Frame frame(shared.scene, passes);
    const gl::Texture color = gl::make_target(GL_RGBA8, 8, 8);
    const gl::Framebuffer target = gl::make_framebuffer(color, {});
    const View main = main_view(flight_pose(shared.small.file.flight, 1.0), shared.small.file.flight, 8, 8);
    for (const View &view : {mirror_view(main, 0.0, 1.0F), main, refraction_view(main, 0.0, 1.0F)}) {
        frame.draw_view(view, target.name());
        CHECK(state.clips == (view.kind != ViewKind::main));
        CHECK(state.turned == (view.kind == ViewKind::mirror));
    }
    CHECK_FALSE(glIsEnabled(GL_CLIP_DISTANCE0));
    test::throw_on_error();
}

TEST_CASE("renderer: plain and mirrored instances of one object both show their fronts") {
    if (!test::have_context()) {
        return;
    }
    const assets::Placement plain{.position = {-1.5, 0.0, 0.0}};
    const assets::Placement mirrored{.position = {1.5, 0.0, 0.0}, .scale = {-1.0, 1.0, 1.0}};
    const auto drawn = [](std::vector<assets::Placement> instances) {
        SmallScene small;
        small.file.shadow.reset();
        small.file.objects[0].materials.clear(); // one-sided
        small.file.objects[0].instances = std::move(instances);
        Streamer streamer = small.streamer();
        streamer.upload({});
        Scene scene(small.file, streamer);
        const gl::ShaderLibrary shaders(gl::ShaderLibrary::find());
        const RenderSettings settings = render_settings(small.file, all_at(Tier::balanced), Device());
        Renderer renderer(scene, shaders, {64, 36, settings, {"post"}});
        return picture(renderer, small.file.flight);
    };
    const std::vector<std::uint8_t> none = drawn({});
    const std::vector<std::uint8_t> left = drawn({plain});
    const std::vector<std::uint8_t> right = drawn({mirrored});
    CHECK(left != none);
    CHECK(right != none);
    std::vector<std::uint8_t> both = none;
    for (std::size_t i = 0; i < both.size(); ++i) {
        both[i] = left[i] != none[i] ? left[i] : right[i];
    }
    CHECK(drawn({plain, mirrored}) == both);
    test::throw_on_error();
}

TEST_CASE("renderer: what moves stands where its second says, though its shadow goes in steps") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    small.file.objects[0].motion.emplace().radius_m = {2.0, 1.0};
    Streamer streamer = small.streamer();
    streamer.upload({});
    Scene scene(small.file, streamer);
    Scene alone(small.file, streamer);
    const gl::ShaderLibrary shaders(gl::ShaderLibrary::find());
    const RenderSettings settings = render_settings(small.file, all_at(Tier::balanced), Device());
    Renderer renderer(scene, shaders, {64, 36, settings, {}});
    for (const double second : {1.07, 1.13}) {
        renderer.draw(second, flight_pose(small.file.flight, second));
        alone.move(second);
        CHECK(scene.objects()[0].instances[0].center == alone.objects()[0].instances[0].center);
    }
    test::throw_on_error();
}

TEST_CASE("renderer: a two-sided blended surface is seen from both sides, a one-sided one from its front") {
    if (!test::have_context()) {
        return;
    }
    const auto drawn = [](bool two_sided, const glm::dquat &rotation, bool there = true) {
        SmallScene small;
        small.file.shadow.reset();
        assets::Material &material = small.file.objects[0].materials[0];
        material = {};
        material.name = "wood";
        material.alpha_mode = assets::AlphaMode::blend;
        material.opacity = 0.5F;
        material.two_sided = two_sided;
        small.file.objects[0].instances = {{.rotation = rotation}};
        small.file.objects[0].camera = there;
        Streamer streamer = small.streamer();
        streamer.upload({.bytes = 2200}); // the sky and the coarsest level of the mesh, of wood alone
        Scene scene(small.file, streamer);
        const gl::ShaderLibrary shaders(gl::ShaderLibrary::find());
        const RenderSettings settings = render_settings(small.file, all_at(Tier::balanced), Device());
        Renderer renderer(scene, shaders, {64, 36, settings, {}});
        return picture(renderer, small.file.flight);
    };
    const glm::dquat up(1.0, 0.0, 0.0, 0.0);
    const glm::dquat down(0.0, 1.0, 0.0, 0.0);
    const std::vector<std::uint8_t> none = drawn(true, up, false);
    CHECK(drawn(true, up) != none);
    CHECK(drawn(true, down) != none);
    CHECK(drawn(false, up) != none);
    CHECK(drawn(false, down) == none);
    test::throw_on_error();
}

TEST_CASE("renderer: shadows are those of the levels that have arrived, also within one second") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    small.file.daytime.resize(2);
    for (assets::DaytimeKey &key : small.file.daytime) {
        key.sun.elevation_rad = 1.2F;
        key.sun.intensity = 3.0F;
        key.sky = "sky";
    }
    small.file.daytime[1].at_s = 5.0;
    small.file.objects[0].materials.clear();
    small.file.objects[0].instances = {{}, {.position = {0.0, -1.0, 0.0}, .scale = glm::dvec3(4.0)}};
    Streamer streamer = small.streamer();
    Scene scene(small.file, streamer);
    const gl::ShaderLibrary shaders(gl::ShaderLibrary::find());
    const RenderSettings settings = render_settings(small.file, all_at(Tier::balanced), Device());
    Renderer kept(scene, shaders, {64, 36, settings, {}});
    std::vector<std::uint8_t> before;
    for (const std::size_t bytes : {std::size_t{0}, std::size_t{2200}, std::size_t{1} << 30U}) {
        if (bytes != 0) {
            streamer.upload({.bytes = bytes});
        }
        Renderer fresh(scene, shaders, {64, 36, settings, {}});
        const std::vector<std::uint8_t> pixels = picture(kept, small.file.flight);
        CHECK(pixels == picture(fresh, small.file.flight));
        CHECK(pixels != before);
        before = pixels;
    }
    test::throw_on_error();
}

TEST_CASE("renderer: shadows are those of the levels of detail near the eye, wherever it was before") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    small.file.shadow->extent_m = 40.0F;
    small.file.objects[0].materials.clear();
    assets::Object row = small.file.objects[0];
    row.camera = false;
    row.instances.clear();
    for (const double x : {-9.0, -3.0, 3.0, 9.0}) {
        row.instances.push_back({.position = {x, 0.0, 0.0}, .scale = glm::dvec3(2.0)});
    }
    small.file.objects[0].instances = {{.position = {0.0, -1.0, 0.0}, .scale = glm::dvec3(20.0)}};
    small.file.objects.push_back(row);
    Streamer streamer = small.streamer();
    streamer.upload({});
    Scene scene(small.file, streamer);
    const gl::ShaderLibrary shaders(gl::ShaderLibrary::find());
    RenderSettings settings = render_settings(small.file, all_at(Tier::balanced), Device());
    settings.shadow_cascades = 1; // it keeps its place, whatever the eye does
    Renderer kept(scene, shaders, {64, 36, settings, {}});
    const auto seen = [&](Renderer &renderer, double x) {
        renderer.draw(1.0, {.eye = {x, 6.0, 0.1}, .target = {0.0, -1.0, 0.0}});
        std::vector<std::uint8_t> pixels;
        renderer.read_picture(pixels);
        return pixels;
    };
    // The second level begins 7.5 m away: behind the first of the row, behind the second.
    for (const double x : {-12.0, -6.0}) {
        const std::vector<std::uint8_t> pixels = seen(kept, x);
        Renderer fresh(scene, shaders, {64, 36, settings, {}});
        CHECK(pixels == seen(fresh, x));
    }
    test::throw_on_error();
}

TEST_CASE("renderer: a shadow is drawn anew when finer holes of its caster arrive") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    assets::Object &below = small.file.objects[0];
    assets::Object caster = below;
    below.materials.clear();
    below.instances = {{.position = {0.0, -1.0, 0.0}, .scale = glm::dvec3(4.0)}};
    caster.camera = false;
    caster.instances = {{}};
    for (assets::Material &material : caster.materials) {
        material.opacity = 1.0F;
        material.alpha_cutoff = 4.5F / 255.0F; // its texel's alpha is 3 / 255, and 5 / 255 two mips coarser
    }
    small.file.objects.push_back(caster);
    Streamer streamer = small.streamer();
    while (!streamer.mesh("quad_mesh")->levels()[0].resident) {
        REQUIRE_FALSE(streamer.upload({.bytes = 2048}));
    }
    REQUIRE(streamer.texture("quad_color")->finest() == 2);
    Scene scene(small.file, streamer);
    const gl::ShaderLibrary shaders(gl::ShaderLibrary::find());
    const RenderSettings settings = render_settings(small.file, all_at(Tier::balanced), Device());
    Renderer kept(scene, shaders, {64, 36, settings, {}});
    const std::vector<std::uint8_t> solid = picture(kept, small.file.flight);
    streamer.upload({});
    const std::vector<std::uint8_t> holed = picture(kept, small.file.flight);
    Renderer fresh(scene, shaders, {64, 36, settings, {}});
    CHECK(holed == picture(fresh, small.file.flight));
    CHECK(holed != solid);
    test::throw_on_error();
}

TEST_CASE(
    "renderer: before their maps have arrived emission gives off nothing and occlusion darkens nothing") {
    if (!test::have_context()) {
        return;
    }
    const auto drawn = [](assets::ObjectMap map, const glm::vec3 &emission, float occlusion_strength = 1.0F,
                          std::size_t bytes = 2200) { // the sky and the coarsest level of the mesh
        SmallScene small;
        small.file.objects[0].materials.resize(1);
        assets::Material &material = small.file.objects[0].materials[0];
        material = {};
        material.name = "wood";
        material.emission = emission;
        material.occlusion_strength = occlusion_strength;
        material.maps[map] = "quad_color";
        Streamer streamer = small.streamer();
        streamer.upload({.bytes = bytes});
        Scene scene(small.file, streamer);
        const gl::ShaderLibrary shaders(gl::ShaderLibrary::find());
        const RenderSettings settings = render_settings(small.file, all_at(Tier::balanced), Device());
        Renderer renderer(scene, shaders, {64, 36, settings, {}});
        return picture(renderer, small.file.flight);
    };
    const glm::vec3 none(0.0F), glowing(2.0F);
    for (const assets::ObjectMap map : {assets::ObjectMap::emission, assets::ObjectMap::second_emission}) {
        CHECK(drawn(map, glowing) == drawn(map, none));
    }
    CHECK(drawn(assets::ObjectMap::normal, glowing) != drawn(assets::ObjectMap::normal, none));
    for (const assets::ObjectMap map : {assets::ObjectMap::occlusion, assets::ObjectMap::second_occlusion}) {
        CHECK(drawn(map, none, 1.0F) == drawn(map, none, 0.0F));
    }
    const std::size_t all = std::size_t{1} << 30U;
    CHECK(drawn(assets::ObjectMap::occlusion, none, 1.0F, all) !=
          drawn(assets::ObjectMap::occlusion, none, 0.0F, all));
    test::throw_on_error();
}
