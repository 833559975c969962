#include "scene/camera.hpp"
#include "streaming/scene.hpp"

#include <doctest/doctest.h>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

#include <array>
#include <cmath>
#include <utility>

using namespace paradize;

namespace {

const Pose pose{{3.0, 4.0, 10.0}, {0.0, 1.0, 0.0}, 0.1};

assets::Flight lens() {
    assets::Flight out;
    out.fov_rad = 0.9F;
    out.near_m = 0.5F;
    out.far_m = 100.0F;
    return out;
}

glm::vec3 project(const View &view, const glm::vec3 &p) {
    const glm::vec4 clip = view.view_projection * glm::vec4(p, 1.0F);
    return glm::vec3(clip) / clip.w;
}

} // namespace

TEST_CASE("mirror: a point is seen where its mirror image is seen by the camera") {
    const float level = 0.5F;
    const View main = main_view(pose, lens(), 640, 360);
    const View mirror = mirror_view(main, level, 0.5F);
    for (const glm::vec3 p : {glm::vec3(0.0F, 2.0F, 0.0F), glm::vec3(1.0F, 0.7F, 3.0F)}) {
        const glm::vec3 image(p.x, 2.0F * level - p.y, p.z);
        CHECK(glm::distance(project(mirror, p), project(main, image)) < 1e-4F);
    }
    CHECK(mirror.eye.y == doctest::Approx(2.0 * level - 4.0));
    CHECK(mirror.mirrored);
    CHECK(mirror.width_px == 320);
    CHECK(mirror.pixels_at_1m == doctest::Approx(main.pixels_at_1m * 0.5F));
}

TEST_CASE("views: a picture drawn smaller shows the same, in its own pixels, also where its sides are odd") {
    assets::SceneFile file;
    file.flight = lens();
    RenderSettings settings;
    settings.reflection_scale = 0.5F;
    settings.samples = 8;
    settings.shadow_size_px = 300;
    const auto all = frame_views(file, settings, pose, 641, 361, glm::vec3(0.0F, 1.0F, 0.0F));
    settings.render_scale = 0.5F;
    const auto half = frame_views(file, settings, pose, 641, 361, glm::vec3(0.0F, 1.0F, 0.0F));
    const View &main = half[static_cast<std::size_t>(ViewKind::main)];
    CHECK(main.width_px == 321);
    CHECK(main.height_px == 181);
    CHECK(half[static_cast<std::size_t>(ViewKind::mirror)].width_px == 161);
    CHECK(main.samples == settings.samples);
    CHECK(half[static_cast<std::size_t>(ViewKind::light)].width_px == settings.shadow_size_px);
    for (const ViewKind kind : {ViewKind::main, ViewKind::mirror, ViewKind::refraction}) {
        const auto i = static_cast<std::size_t>(kind);
        CHECK(half[i].view_projection == all[i].view_projection);
        CHECK(half[i].pixels_at_1m == doctest::Approx(0.5F * all[i].pixels_at_1m));
    }
    CHECK(scaled_px(1, 0.25F) == 1);
}

TEST_CASE("views: a jitter moves the picture and the shadow map by as many of their pixels") {
    assets::SceneFile file;
    file.flight = lens();
    const RenderSettings settings;
    const glm::vec3 sun(0.0F, 1.0F, 0.0F);
    const glm::vec2 pixel(0.25F, -0.5F);
    const auto still = frame_views(file, settings, pose, 640, 360, sun);
    const auto moved = frame_views(file, settings, pose, 640, 360, sun, pixel);
    for (const ViewKind kind : {ViewKind::main, ViewKind::light}) {
        const auto i = static_cast<std::size_t>(kind);
        const glm::vec2 way(project(moved[i], glm::vec3(0.5F)) - project(still[i], glm::vec3(0.5F)));
        const glm::vec2 sides(moved[i].width_px, moved[i].height_px);
        CHECK(glm::distance(0.5F * way * sides, pixel) < 0.01F);
    }
}

TEST_CASE("mirror: clips what is below the water; the refraction clips what is above") {
    const View main = main_view(pose, lens(), 640, 360);
    const View mirror = mirror_view(main, 0.0F, 1.0F);
    const View below = refraction_view(main, 0.0F, 1.0F);
    const auto kept = [](const View &view, float y) {
        return glm::dot(view.clip_plane, glm::vec4(0.0F, y, 0.0F, 1.0F)) >= 0.0F;
    };
    for (const float y : {0.0F, 1.0F}) { // both hold the waterline
        CHECK(kept(mirror, y));
        CHECK(kept(below, -y));
    }
    for (const float y : {0.1F, 1.0F}) {
        CHECK_FALSE(kept(mirror, -y));
        CHECK_FALSE(kept(below, y));
    }
    CHECK(kept(mirror_view(main, 2.0, 1.0F), 2.1F));
    CHECK_FALSE(kept(mirror_view(main, 2.0, 1.0F), 1.5F));
    CHECK_FALSE(mirror.sees({0.0F, -3.0F, 0.0F}, 1.0F));
    CHECK(mirror.sees({0.0F, 1.0F, 0.0F}, 1.0F));
}

TEST_CASE("frustum: spheres inside and across the border are visible, outside not") {
    const View view = main_view({{0.0, 0.0, 0.0}, {0.0, 0.0, -1.0}, 0.0}, lens(), 100, 100);
    CHECK(view.sees({0.0F, 0.0F, -10.0F}, 0.1F));
    CHECK_FALSE(view.sees({0.0F, 0.0F, 10.0F}, 0.1F));
    CHECK_FALSE(view.sees({0.0F, 0.0F, -102.0F}, 1.0F));
    CHECK(view.sees({0.0F, 0.0F, -100.5F}, 1.0F));
    const float edge = 10.0F * std::tan(0.45F);
    CHECK_FALSE(view.sees({edge + 2.0F, 0.0F, -10.0F}, 1.0F));
    CHECK(view.sees({edge + 0.5F, 0.0F, -10.0F}, 1.0F));
}

TEST_CASE("light: the square's centre is the map's centre, and heights stay inside its depth range") {
    assets::Shadow shadow;
    shadow.extent_m = 40.0F;
    shadow.center = glm::dvec3(5.0, 0.0, -3.0);
    const View view = light_view(shadow, glm::normalize(glm::vec3(0.4F, 0.3F, 0.2F)));
    const glm::vec3 center(shadow.center);
    const glm::vec4 middle = texture_from_clip() * view.view_projection * glm::vec4(center, 1.0F);
    CHECK(middle.x == doctest::Approx(0.5));
    CHECK(middle.y == doctest::Approx(0.5));
    CHECK(middle.z == doctest::Approx(0.5));
    const glm::vec3 high = project(view, center + glm::vec3(0.0F, 19.0F, 0.0F));
    CHECK(std::abs(high.z) < 1.0F);
    const View low = light_view(shadow, glm::normalize(glm::vec3(1.0F, 0.02F, 1.0F))); // along a diagonal
    for (const float side_m : {-20.0F, 20.0F}) {
        CHECK(std::abs(project(low, center + glm::vec3(side_m, 0.0F, side_m)).z) < 1.0F);
    }
}

TEST_CASE("floating origin: points near a distant eye project as near an eye at the world's origin") {
    assets::Shadow shadow;
    shadow.center = glm::dvec3(5.0, 0.0, -3.0);
    const glm::vec3 sun = glm::normalize(glm::vec3(0.4F, 0.3F, 0.2F));
    const glm::dvec3 thing(1.0, 0.7, 3.0);
    for (const glm::dvec3 away : {glm::dvec3(1e6, 0.0, -1e6), glm::dvec3(-5.2e6, 1e5, 5e5)}) {
        const auto moved = [&](const glm::dvec3 &p) { return p + away; };
        const View main = main_view(pose, lens(), 640, 360);
        const View far = main_view({moved(pose.eye), moved(pose.target), pose.roll_rad}, lens(), 640, 360);
        CHECK(far.anchor != glm::dvec3(0.0));
        CHECK(main.anchor == glm::dvec3(0.0));
        CHECK(glm::distance(project(far, far.local(moved(thing))), project(main, main.local(thing))) < 1e-4F);
        const View below = refraction_view(far, away.y + 0.5, 1.0F);
        const View near_below = refraction_view(main, 0.5, 1.0F);
        const float above = glm::dot(below.clip_plane, glm::vec4(far.local(moved(thing)), 1.0F));
        CHECK(std::abs(above - glm::dot(near_below.clip_plane, glm::vec4(main.local(thing), 1.0F))) < 2e-4F);
        assets::Shadow there = shadow;
        there.center = moved(shadow.center);
        for (const auto &[one, other] :
             {std::pair(light_view(there, sun, far.anchor), light_view(shadow, sun)),
              std::pair(mirror_view(far, away.y + 0.5, 1.0F), mirror_view(main, 0.5, 1.0F))}) {
            CHECK(glm::distance(project(one, one.local(moved(thing))), project(other, other.local(thing))) <
                  2e-4F);
            CHECK(glm::distance(glm::dvec3(one.eye) + one.anchor - away, glm::dvec3(other.eye)) < 2e-4);
        }
    }
}

TEST_CASE("light: a sun in the zenith has a valid view") {
    const View view = light_view(assets::Shadow(), {0.0F, 1.0F, 0.0F});
    CHECK(std::isfinite(view.view_projection[0][0]));
    CHECK(std::abs(project(view, glm::vec3(0.0F)).x) < 1e-5F);
}

TEST_CASE("levels of detail: the coarsest level with an accepted error is chosen") {
    const std::array<float, 3> errors{0.0F, 0.01F, 0.1F};
    const float pixels_at_1m = 400.0F;
    CHECK(choose_lod(errors, 1.0F, pixels_at_1m, 1.0F) == 0);
    CHECK(choose_lod(errors, 4.1F, pixels_at_1m, 1.0F) == 1);
    CHECK(choose_lod(errors, 41.0F, pixels_at_1m, 1.0F) == 2);
    CHECK(choose_lod(errors, -1.0F, pixels_at_1m, 1.0F) == 0);
    CHECK(choose_lod(std::span(errors).first(1), 1000.0F, pixels_at_1m, 1.0F) == 0);
}
