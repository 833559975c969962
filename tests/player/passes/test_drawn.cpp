// Numbers of scene.json in finished pictures of a few triangles.

#include "context.hpp"
#include "gl/shader_library.hpp"
#include "passes/environment_bindings.hpp"
#include "render/renderer.hpp"
#include "small_scene.hpp"

#include <doctest/doctest.h>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

using namespace paradize;
using paradize::test::SmallScene;

namespace {

using Pixels = std::vector<std::uint8_t>; // RGB, first row at the top

/// A pose, a size and settings, of a scene whose files have all arrived.
struct Shot {
    Pose pose{.eye = {1.0, 2.0, 5.0}, .target = {0.0, 0.0, 0.0}};
    std::vector<std::string> disabled;
    int width_px = 64, height_px = 36;
    double elapsed_s = 1.0;
    Quality quality = all_at(Tier::balanced);
    std::uint64_t draw_calls = 0; // of the last picture

    Pixels of(SmallScene &small) {
        Streamer streamer = small.streamer();
        streamer.upload({});
        Scene scene(small.file, streamer);
        const gl::ShaderLibrary shaders(gl::ShaderLibrary::find());
        const RenderSettings settings = render_settings(small.file, quality, Device());
        Renderer renderer(scene, shaders, {width_px, height_px, settings, disabled});
        renderer.draw(elapsed_s, pose);
        draw_calls = renderer.draw_calls();
        Pixels pixels;
        renderer.read_picture(pixels);
        test::throw_on_error();
        return pixels;
    }
};

int sum_of(const Pixels &pixels) {
    return std::accumulate(pixels.begin(), pixels.end(), 0);
}

/// The mean difference of two pictures' values, of 255.
double mean_difference(const Pixels &a, const Pixels &b) {
    int sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        sum += std::abs(int{a[i]} - int{b[i]});
    }
    return static_cast<double>(sum) / static_cast<double>(a.size());
}

/// Red in the middle of a row.
int red_in_row(const Pixels &pixels, const Shot &shot, int row) {
    return pixels[static_cast<std::size_t>(3 * (row * shot.width_px + shot.width_px / 2))];
}

/// A sea with waves of 10 m over the quad, which lies 0.3 m below it.
struct SeaOverQuad : SmallScene {
    assets::Water &water = file.water.emplace();

    SeaOverQuad() {
        water.normal = water.dudv = "quad_color";
        water.level_m = 0.3F;
        water.size_m = 200.0F;
        water.wave_repeat = 20.0F;
        water.reflection_distortion = 0.0F;
        file.refraction_scale = 0.5F;
    }
};

/// Nothing but the sky, in clear air, by so many keys of the daytime.
struct OnlySky : SmallScene {
    explicit OnlySky(std::size_t keys) {
        file.objects.clear();
        file.shadow.reset();
        file.fog.density_per_m = 0.0F;
        file.daytime.resize(keys);
        for (assets::DaytimeKey &key : file.daytime) {
            key.sky = "sky";
        }
    }
};

} // namespace

TEST_CASE("water: waves move what is mirrored and what is refracted, each by its own strength") {
    if (!test::have_context()) {
        return;
    }
    for (const std::string blind : {"", "reflection", "refraction"}) {
        SeaOverQuad sea;
        Shot shot{.disabled = {blind}};
        const Pixels calm = shot.of(sea);
        sea.water.reflection_distortion = 0.05F;
        CHECK((shot.of(sea) != calm) == (blind != "reflection"));
        sea.water.reflection_distortion = 0.0F;
        sea.water.refraction_distortion = 0.05F;
        CHECK((shot.of(sea) != calm) == (blind != "refraction"));
    }
}

TEST_CASE("water: it mirrors nothing from below its surface, and shows nothing from above through it") {
    if (!test::have_context()) {
        return;
    }
    for (const bool mirror : {true, false}) {
        for (const double y : {1.0, 0.0}) { // above the water, below it
            SeaOverQuad sea;
            assets::Object &quad = sea.file.objects[0];
            quad.materials.clear();
            const glm::dquat turned(0.0, 1.0, 0.0, 0.0); // towards an eye below it
            quad.instances = {{.position = {0.0, y, 0.0}}, {.position = {0.0, y, 0.0}, .rotation = turned}};
            quad.camera = quad.shadow = false;
            quad.reflection = mirror;
            quad.refraction = !mirror;
            Shot shot{.disabled = {"sky"}};
            const Pixels seen = shot.of(sea);
            quad.reflection = quad.refraction = false;
            CAPTURE(mirror);
            CAPTURE(y);
            CHECK((seen != shot.of(sea)) == (mirror == (y > 0.3)));
        }
    }
}

TEST_CASE("water: without the picture of a mirror it mirrors the sky") {
    if (!test::have_context()) {
        return;
    }
    SeaOverQuad sea;
    sea.file.objects.clear();
    Shot dark{.disabled = {"sky", "refraction"}}; // the mirror shows nothing
    Shot blind{.disabled = {"sky", "refraction", "reflection"}};
    CHECK(sum_of(blind.of(sea)) > sum_of(dark.of(sea)));
}

TEST_CASE("water: without specular light its smoothness is not seen") {
    if (!test::have_context()) {
        return;
    }
    for (const float specular : {0.0F, 1.0F}) {
        SeaOverQuad sea;
        Shot shot;
        sea.water.specular = specular;
        sea.water.smoothness = 0.3F;
        const Pixels rough = shot.of(sea);
        sea.water.smoothness = 0.8F;
        CHECK((shot.of(sea) != rough) == (specular > 0.0F));
    }
}

TEST_CASE("water: the sea is as wide as its size") {
    if (!test::have_context()) {
        return;
    }
    SeaOverQuad sea;
    sea.file.objects.clear();
    sea.water.level_m = 0.0F;
    sea.water.size_m = 4.0F;
    Shot shot{.pose = {.eye = {0.0, 5.0, 0.0}, .target = {0.0, 0.0, -0.01}}, .disabled = {"sky", "post"}};
    const Pixels seen = shot.of(sea);
    shot.disabled.emplace_back("water");
    const Pixels bare = shot.of(sea);
    int columns = 0;
    for (std::size_t i = std::size_t{18} * 64 * 3; i < std::size_t{19} * 64 * 3; i += 3) {
        columns += std::equal(&seen[i], &seen[i + 3], &bare[i]) ? 0 : 1;
    }
    CHECK(columns == doctest::Approx(29.8).epsilon(0.05)); // of 64, which see 8.6 m
}

TEST_CASE("water: the sea fades into haze between 0.38 and 0.66 of the far plane's distance") {
    if (!test::have_context()) {
        return;
    }
    SeaOverQuad sea;
    sea.file.objects.clear();
    sea.water.level_m = 0.0F;
    sea.file.fog.density_per_m = 0.0F;
    Shot shot{.pose = {.eye = {0.0, 5.0, 0.0}, .target = {0.0, 5.0, -1.0}}, .disabled = {"sky", "post"}};
    shot.width_px = 16;
    shot.height_px = 144;
    sea.file.fog.color = glm::vec3(0.0F);
    const Pixels clear = shot.of(sea);
    sea.file.fog.color = glm::vec3(1.0F, 0.0F, 0.0F);
    const Pixels hazy = shot.of(sea);
    const auto haze = [&](int row) { return red_in_row(hazy, shot, row) - red_in_row(clear, shot, row); };
    CHECK(haze(93) < 3);    // 35 m away of 100
    CHECK(haze(83) >= 250); // 65 m
}

TEST_CASE("water: the sea is seen from below") {
    if (!test::have_context()) {
        return;
    }
    SeaOverQuad sea;
    sea.file.objects.clear();
    Shot shot{.pose = {.eye = {0.0, -1.0, 0.0}, .target = {0.0, 4.0, -2.0}}, .disabled = {"sky"}};
    const Pixels seen = shot.of(sea);
    shot.disabled.emplace_back("water");
    CHECK(seen != shot.of(sea));
}

TEST_CASE("water: around an eye in it, it glows by the sun and by the light from all around") {
    assets::SceneFile file;
    assets::Water &water = file.water.emplace();
    water.shallow_color = {0.1F, 0.2F, 0.3F};
    water.deep_color = {0.3F, 0.2F, 0.1F};
    Daylight daylight;
    daylight.ambient = glm::vec3(2.0F);
    CHECK(water_glow(file, daylight).x == doctest::Approx(0.2));
    daylight.radiance = glm::vec3(3.14159265F);
    CHECK(water_glow(file, daylight).x == doctest::Approx(0.4));
    daylight.to_light = {0.8F, 0.6F, 0.0F};
    CHECK(water_glow(file, daylight).x == doctest::Approx(0.32));
}

TEST_CASE("glow: a scene four times as bright at a quarter of the exposure is the same picture") {
    if (!test::have_context()) {
        return;
    }
    const auto lamp = [](float emission, float exposure) {
        SmallScene small;
        small.file.objects[0].materials.clear();
        for (const char *name : {"wood", "leaf"}) {
            assets::Material material;
            material.name = name;
            material.emission = glm::vec3(emission);
            small.file.objects[0].materials.push_back(material);
        }
        small.file.sun.intensity = small.file.ambient.intensity = small.file.fog.density_per_m = 0.0F;
        small.file.exposure = exposure;
        Shot shot{.disabled = {"sky"}};
        return shot.of(small);
    };
    const Pixels bright = lamp(8.0F, 0.25F);
    CHECK(bright == lamp(2.0F, 1.0F));
    CHECK(bright != lamp(2.0F, 0.25F));
}

TEST_CASE("shadow: a surface that nothing shades is as bright as without shadows") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    small.file.shadow->size_px = 512;
    small.file.objects[0].materials.clear();
    small.file.objects[0].instances = {{}};
    for (const glm::vec3 &sun :
         {glm::vec3(0.0F, 1.0F, 0.0F), glm::vec3(0.6F, 0.8F, 0.0F), glm::vec3(0.8F, 0.6F, 0.0F)}) {
        small.file.sun.direction = sun;
        Shot shot{.disabled = {"post"}};
        Shot unshaded{.disabled = {"post", "shadow"}};
        CHECK(shot.of(small) == unshaded.of(small));
    }
    small.file.objects[0].instances.push_back({.position = {0.0, 1.0, 0.0}, .scale = glm::dvec3(0.3)});
    small.file.sun.direction = {0.0F, 1.0F, 0.0F};
    Shot shot{.disabled = {"post"}};
    Shot unshaded{.disabled = {"post", "shadow"}};
    CHECK(sum_of(shot.of(small)) < sum_of(unshaded.of(small)));
}

TEST_CASE("shadow: without light of sun or moon neither shadows nor lit air are drawn") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    Shot with, without{.disabled = {"shadow"}};
    const auto calls = [&] {
        with.of(small);
        without.of(small);
        return with.draw_calls - without.draw_calls;
    };
    small.file.sun.intensity = 2.0F;
    const std::uint64_t of_shadows = calls();
    CHECK(of_shadows > 0);
    small.file.light_shafts.emplace();
    CHECK(calls() == of_shadows + 3);
    small.file.sun.intensity = 0.0F;
    CHECK(calls() == 0);
    CHECK(with.of(small) == without.of(small));
}

TEST_CASE(
    "shadow: when light returns from elsewhere after a dark moment the picture is that of a first frame") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    small.file.light_shafts.emplace();
    assets::Sun &sun = small.file.sun;
    Shot shot;
    Streamer streamer = small.streamer();
    streamer.upload({});
    Scene scene(small.file, streamer);
    const gl::ShaderLibrary shaders(gl::ShaderLibrary::find());
    const RenderSettings settings = render_settings(small.file, shot.quality, Device());
    Renderer renderer(scene, shaders, {shot.width_px, shot.height_px, settings, {}});
    const auto drawn = [&](const glm::vec3 &direction, float intensity) {
        sun.direction = direction;
        sun.intensity = intensity;
        renderer.draw(shot.elapsed_s, shot.pose);
        Pixels pixels;
        renderer.read_picture(pixels);
        return pixels;
    };
    const glm::vec3 morning(0.8F, 0.6F, 0.0F), evening(-0.8F, 0.6F, 0.0F);
    for (const auto &[direction, intensity] :
         {std::pair(morning, 2.0F), std::pair(evening, 0.0F), std::pair(evening, 2.0F),
          std::pair(morning, 0.0F), std::pair(morning, 2.0F)}) {
        const Pixels pixels = drawn(direction, intensity);
        CHECK(pixels == shot.of(small));
    }
    CHECK(drawn(morning, 2.0F) != drawn(evening, 2.0F));
    test::throw_on_error();
}

TEST_CASE("shadow: its edge is as soft as the sun is wide, up to the distance of blur") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    small.file.shadow->size_px = 256;
    small.file.shadow->extent_m = 100.0F;
    small.file.sun.intensity = 2.0F;
    small.file.ambient.intensity = 0.0F;
    small.file.objects[0].materials.clear();
    small.file.objects[0].instances = {{.scale = glm::dvec3(10.0)},
                                       {.position = {-6.0, 8.0, 0.0}, .scale = {6.0, 1.0, 6.0}}};
    // Its edge from 1 m above: a row of 160 pixels, 93.2 to a metre.
    Shot shot{.pose = {.eye = {0.0, 1.0, 0.0}, .target = {0.0, 0.0, -0.01}}, .disabled = {"sky", "post"}};
    shot.width_px = 160;
    shot.height_px = 90;
    const auto width_m = [&](float diameter_rad, float blur_distance_m) {
        small.file.sun.angular_diameter_rad = diameter_rad;
        small.file.shadow->blur_distance_m = blur_distance_m;
        const Pixels pixels = shot.of(small);
        const auto red = [&](int column) {
            return static_cast<int>(pixels[static_cast<std::size_t>(3 * (45 * 160 + column))]);
        };
        int soft_px = 0;
        for (int column = 0; column < 160; ++column) {
            soft_px += red(column) > red(0) + 2 && red(column) < red(159) - 2 ? 1 : 0;
        }
        return soft_px / 93.2;
    };
    // As of casters 14 m away. Beyond the distance of blur it is sharp.
    CHECK(width_m(0.01F, 50.0F) == doctest::Approx(0.14).epsilon(0.02));
    CHECK(width_m(0.02F, 50.0F) == doctest::Approx(0.28).epsilon(0.02));
    CHECK(width_m(0.02F, 1.0F) < 0.1);
}

TEST_CASE("shadow: a finer cascade draws the casters in it, not those of the whole map") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    small.file.shadow->extent_m = 40.0F;
    small.file.objects[0].materials.clear();
    const auto calls = [&](double away_m) {
        small.file.objects[0].instances = {{.position = {-away_m, 0.0, -away_m}, .scale = glm::dvec3(0.5)}};
        Shot with, without{.disabled = {"shadow"}};
        with.of(small);
        without.of(small);
        return with.draw_calls - without.draw_calls;
    };
    CHECK(calls(0.0) == 3);
    CHECK(calls(18.0) == 1);
}

TEST_CASE("beams: each is as bright as its own lamp is now, and hides no other") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    small.file.objects.clear();
    small.file.fog.density_per_m = 0.01F;
    Shot shot{.pose = {.eye = {0.0, 2.0, 6.0}, .target = {0.0, 2.0, 0.0}}, .disabled = {"sky", "post"}};
    const auto beams = [&](std::vector<assets::PointLight> lights) {
        small.file.lights = std::move(lights);
        return shot.of(small);
    };
    const assets::PointLight off{.name = "off", .always = false, .on_s = 5.0, .off_s = 6.0, .beam_m = 20.0F};
    const assets::PointLight on{
        .name = "on", .position = {0.0, 1.0, 0.0}, .intensity = 4.0F, .beam_m = 20.0F};
    assets::PointLight half_lit = on; // at second 1
    half_lit.intensity = 8.0F;
    half_lit.always = false;
    half_lit.off_s = 5.0;
    half_lit.fade_s = 2.0F;
    assets::PointLight behind = on;
    behind.position.z = -3.0;
    const Pixels lit = beams({off, on});
    const int none = sum_of(beams({off}));
    const int one = sum_of(lit) - none;
    CHECK(one > 1000);
    CHECK(beams({off, half_lit}) == lit);
    CHECK(sum_of(beams({on, behind})) - none ==
          doctest::Approx(one + sum_of(beams({behind})) - none).epsilon(0.03));
}

TEST_CASE("water: it mirrors the sky, beams and particles that are above the picture") {
    if (!test::have_context()) {
        return;
    }
    SeaOverQuad sea;
    sea.file.objects.clear();
    sea.file.fog.density_per_m = 0.01F;
    sea.file.lights.push_back(
        {.name = "lamp", .position = {0.0, 5.0, -30.0}, .intensity = 5e3F, .beam_m = 20.0F});
    sea.file.particles.push_back({.name = "sparks",
                                  .center = {0.0, 9.0, -30.0},
                                  .radius_m = 3.0F,
                                  .count = 200,
                                  .size_m = {0.5F, 1.0F}});
    const Pose down{.eye = {0.0, 5.0, 0.0}, .target = {0.0, 0.0, -8.0}};
    for (const std::string pass : {"sky", "beams", "particles"}) {
        Shot seen{.pose = down, .disabled = {}}, bare{.pose = down, .disabled = {pass}};
        CAPTURE(pass);
        CHECK(sum_of(seen.of(sea)) > sum_of(bare.of(sea)));
        seen.disabled.emplace_back("reflection");
        bare.disabled.emplace_back("reflection");
        CHECK(seen.of(sea) == bare.of(sea));
    }
}

TEST_CASE("water: it hides beams and particles that are below it") {
    if (!test::have_context()) {
        return;
    }
    SeaOverQuad sea;
    sea.file.objects.clear();
    sea.file.fog.density_per_m = 0.01F;
    const Pose down{.eye = {0.0, 5.0, 0.0}, .target = {0.0, 0.0, -8.0}};
    for (const bool above : {true, false}) {
        const double lamp_m = above ? 3.0 : -10.0, sparks_m = above ? 3.0 : -3.5;
        sea.file.lights = {
            {.name = "lamp", .position = {0.0, lamp_m, -10.0}, .intensity = 5e3F, .beam_m = 8.0F}};
        sea.file.particles = {{.name = "sparks",
                               .center = {0.0, sparks_m, -10.0},
                               .radius_m = 2.0F,
                               .count = 200,
                               .size_m = {0.5F, 1.0F}}};
        for (const std::string pass : {"beams", "particles"}) {
            Shot seen{.pose = down, .disabled = {}}, bare{.pose = down, .disabled = {pass}};
            CAPTURE(pass);
            CHECK((seen.of(sea) != bare.of(sea)) == above);
        }
    }
}

TEST_CASE("particles: insects darken the sky and sparkles light it, each field where it stands") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    small.file.objects.clear();
    Shot shot{.pose = {.eye = {0.0, 0.0, 6.0}, .target = {0.0, 0.0, 0.0}}, .disabled = {"post"}};
    const auto field = [](double x, bool swarm) {
        return assets::ParticleField{
            .name = "field", .center = {x, 0.0, 0.0}, .count = 60, .size_m = {0.2F, 0.3F}, .swarm = swarm};
    };
    const Pixels bare = shot.of(small);
    struct Changed {
        int left = 0, right = 0, darker = 0, brighter = 0;
    };
    const auto changed = [&](std::vector<assets::ParticleField> fields) {
        small.file.particles = std::move(fields);
        const Pixels seen = shot.of(small);
        Changed out;
        for (std::size_t i = 0; i < seen.size(); ++i) {
            (i / 3 % 64 < 32 ? out.left : out.right) += seen[i] != bare[i] ? 1 : 0;
            out.darker += seen[i] < bare[i] ? 1 : 0;
            out.brighter += seen[i] > bare[i] ? 1 : 0;
        }
        return out;
    };
    const Changed swarms = changed({field(-2.0, true), field(2.0, true)});
    CHECK(swarms.left > 100);
    CHECK(swarms.right > 100);
    CHECK(swarms.brighter == 0);
    const Changed sparkles = changed({field(-2.0, false), field(2.0, false)});
    CHECK(sparkles.left > 100);
    CHECK(sparkles.right > 100);
    CHECK(sparkles.darker == 0);
    for (const bool swarm : {false, true}) {
        const auto seen_at = [&](double x) {
            small.file.particles = {field(x, swarm)};
            Shot moved = shot;
            moved.pose.eye.x = moved.pose.target.x = x;
            return moved.of(small);
        };
        CHECK(seen_at(1048576.0) == seen_at(0.0));
    }
    // Two fields at one place are no copies of each other.
    const Changed one = changed({field(0.0, false)}), two = changed({field(0.0, false), field(0.0, false)});
    CHECK(two.brighter > 1.1 * one.brighter);
}

TEST_CASE("particles: sparkles have their field's colour, and are dark when they are born") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    small.file.objects.clear();
    Shot shot{.pose = {.eye = {0.0, 0.0, 6.0}, .target = {0.0, 0.0, 0.0}}, .disabled = {"sky", "post"}};
    const auto seen = [&](float threshold) { // of life, which no particle here loses
        small.file.particles = {{.name = "field",
                                 .count = 60,
                                 .size_m = {0.2F, 0.3F},
                                 .life_per_s = {0.0F, 0.0F},
                                 .threshold = threshold,
                                 .color = {0.5F, 0.0F, 0.0F}}};
        return shot.of(small);
    };
    const Pixels old = seen(0.0F);
    int red = 0;
    for (std::size_t i = 0; i < old.size(); i += 3) {
        red += old[i];
    }
    CHECK(red > 1000);
    CHECK(red == sum_of(old));
    CHECK(sum_of(seen(0.99F)) < 0.2 * sum_of(old));
}

TEST_CASE("particles: insects hide as much of the sky as their lamp is on, and show its light") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    small.file.objects.clear();
    Shot shot{.pose = {.eye = {0.0, 0.0, 6.0}, .target = {0.0, 0.0, 0.0}}, .disabled = {"post"}};
    const auto seen = [&](double off_s, float fade_s, const glm::vec3 &light) {
        small.file.lights = {
            {.name = "lamp", .color = light, .always = false, .off_s = off_s, .fade_s = fade_s}};
        return shot.of(small);
    };
    const int bare = sum_of(seen(5.0, 0.0F, glm::vec3(0.0F)));
    small.file.particles = {{.name = "field", .count = 20, .size_m = {0.1F, 0.2F}, .swarm = true}};
    const glm::vec3 black(0.0F), green(0.0F, 1.0F, 0.0F);
    const Pixels dark = seen(5.0, 0.0F, black);
    CHECK(bare - sum_of(dark) > 1000);
    // Half lit at second 1.
    CHECK(bare - sum_of(seen(5.0, 2.0F, black)) == doctest::Approx(0.5 * (bare - sum_of(dark))).epsilon(0.1));
    const Pixels lit = seen(5.0, 0.0F, green);
    int more_green = 0;
    for (std::size_t i = 1; i < lit.size(); i += 3) {
        more_green += lit[i] - dark[i];
    }
    CHECK(more_green > 1000);
    CHECK(more_green == sum_of(lit) - sum_of(dark));
}

TEST_CASE(
    "lamps: a surface is lit by those of its set, as bright as they are now, wherever the eye was before") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    assets::SceneFile &file = small.file;
    file.shadow.reset();
    file.sun.intensity = file.ambient.intensity = file.fog.density_per_m = 0.0F;
    assets::Object &quad = file.objects[0];
    quad.materials.clear();
    quad.instances = {{}};
    quad.light_sets = {1};
    file.light_sets = {{}, {.lights = {1}, .glow = {}}};
    file.lights.push_back({.name = "off", .always = false, .on_s = 5.0, .off_s = 6.0});
    file.lights.push_back({.name = "on", .position = {0.0, 0.3, 0.0}});
    const std::vector<std::string> disabled{"sky", "post"};
    const Pose pose{.eye = {0.0, 2.0, 2.0}, .target = {0.0, 0.0, 0.0}};
    Shot shot{.pose = pose, .disabled = disabled};
    const Pixels lit = shot.of(small);
    CHECK(sum_of(lit) > 10000);

    Streamer streamer = small.streamer();
    streamer.upload({});
    Scene scene(file, streamer);
    const gl::ShaderLibrary shaders(gl::ShaderLibrary::find());
    const RenderSettings settings = render_settings(file, all_at(Tier::balanced), Device());
    Renderer renderer(scene, shaders, {shot.width_px, shot.height_px, settings, disabled});
    renderer.draw(1.0, {.eye = {5000.0, 2.0, 2.0}, .target = {5000.0, 0.0, 0.0}});
    renderer.draw(1.0, pose);
    Pixels pixels;
    renderer.read_picture(pixels);
    CHECK(pixels == lit);

    const assets::PointLight on = file.lights[1];
    file.lights[1].intensity = 2.0F;
    file.lights[1].always = false;
    file.lights[1].off_s = 5.0;
    file.lights[1].fade_s = 2.0F; // half lit at second 1
    CHECK(shot.of(small) == lit);
    file.lights[1] = on;

    file.light_sets[1].glow = 0; // which is off
    assets::Material glowing;
    glowing.name = "wood";
    glowing.emission = glm::vec3(1.0F);
    quad.materials = {glowing};
    CHECK(shot.of(small) == lit);
    file.light_sets[1].glow = 1;
    CHECK(sum_of(shot.of(small)) > sum_of(lit));

    quad.materials.clear();
    file.light_sets[1].glow.reset();
    file.lights[1].radius_m = 0.5F; // finite close to it
    CHECK(sum_of(shot.of(small)) < sum_of(lit));
    test::throw_on_error();
}

TEST_CASE("sky: each of the two skies of a moment is turned by its own key") {
    if (!test::have_context()) {
        return;
    }
    OnlySky small(2);
    for (assets::DaytimeKey &key : small.file.daytime) {
        key.sun.elevation_rad = 1.2F;
        key.sun.intensity = key.moon.intensity = 0.0F;
    }
    const float turn_rad = glm::radians(30.0F);
    const auto seen = [&](float before_rad, float after_rad, double after_s, float azimuth_rad) {
        small.file.daytime[0].sky_azimuth_rad = -before_rad;
        small.file.daytime[1].sky_azimuth_rad = -after_rad;
        small.file.daytime[1].at_s = after_s;
        Shot shot{
            .pose = {.eye = {0.0, 1.0, 0.0}, .target = {std::sin(azimuth_rad), 1.1, -std::cos(azimuth_rad)}},
            .disabled = {"post"}};
        return shot.of(small);
    };
    const double soon_s = 1.000001, late_s = 9.999; // at second 1 the later sky is seen alone, or the earlier
    const Pixels straight = seen(0.0F, 0.0F, soon_s, 0.0F);
    CHECK(mean_difference(seen(0.0F, turn_rad, soon_s, turn_rad), straight) < 1.0);
    CHECK(mean_difference(seen(0.0F, turn_rad, soon_s, 0.0F), straight) > 5.0);
    CHECK(mean_difference(seen(turn_rad, 0.0F, late_s, turn_rad), straight) < 1.0);
    CHECK(mean_difference(seen(turn_rad, 0.0F, late_s, 0.0F), straight) > 5.0);
}

TEST_CASE("sky: the stars end the flight where they began it") {
    if (!test::have_context()) {
        return;
    }
    OnlySky small(1);
    assets::DaytimeKey &key = small.file.daytime[0];
    key.sun.elevation_rad = key.moon.elevation_rad = -0.5F;
    const auto at = [&](double elapsed_s) {
        Shot shot{.pose = {.eye = {0.0, 1.0, 0.0}, .target = {1.0, 2.0, 0.0}},
                  .disabled = {"post"},
                  .width_px = 256,
                  .height_px = 144,
                  .elapsed_s = elapsed_s};
        return shot.of(small);
    };
    const Pixels first = at(0.0);
    CHECK(mean_difference(at(9.99999), first) < 0.05);
    CHECK(mean_difference(at(5.0), first) > 0.5);
}

TEST_CASE("sky: stars give a picture that is drawn smaller and enlarged as much light") {
    if (!test::have_context()) {
        return;
    }
    OnlySky small(1);
    assets::DaytimeKey &key = small.file.daytime[0];
    key.sun.elevation_rad = key.moon.elevation_rad = -0.5F;
    test::Bytes sky = test::ktx2_file(assets::PixelFormat::rgba8_unorm, 8, 8, 6);
    std::fill(sky.end() - std::ptrdiff_t{4 * 6 * (64 + 16 + 4 + 1)}, sky.end(), std::byte{0}); // all mips
    small.put("sky", sky);
    Shot shot{.pose = {.eye = {0.0, 1.0, 0.0}, .target = {1.0, 2.0, 0.0}},
              .disabled = {"post"},
              .width_px = 256,
              .height_px = 144};
    const int whole = sum_of(shot.of(small));
    shot.quality[static_cast<std::size_t>(QualityFeature::resolution)] = Tier::fast;
    CHECK(whole > 10000);
    CHECK(sum_of(shot.of(small)) == doctest::Approx(whole).epsilon(0.15));
}
