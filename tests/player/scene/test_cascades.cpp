// Cascades of the shadow map: which squares they are, and that their texels keep their places in the world.

#include "scene/camera.hpp"
#include "scene/cascades.hpp"

#include <doctest/doctest.h>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include <cmath>

using namespace paradize;

namespace {

const glm::vec3 sun = glm::normalize(glm::vec3(0.4F, 0.5F, -0.3F));

assets::Shadow square(int size_px = 2048) {
    assets::Shadow out;
    out.size_px = size_px;
    out.extent_m = 110.0F;
    out.center = glm::dvec3(4.0, 1.0, 12.0);
    return out;
}

View camera(const glm::dvec3 &eye, const glm::dvec3 &target) {
    assets::Flight lens;
    lens.fov_rad = 0.9F;
    lens.near_m = 0.2F;
    lens.far_m = 2000.0F;
    return main_view({eye, target, 0.0}, lens, 640, 360);
}

View cascade_at(const assets::Shadow &shadow, const View &main, int cascade) {
    return cascade_view(shadow, light_view(shadow, sun, main.anchor), main, cascade);
}

/// Where a world position lies in a view, in texels from the bottom left.
glm::dvec2 texel(const View &view, const glm::dvec3 &world) {
    const glm::dvec4 clip = glm::dmat4(view.view_projection) * glm::dvec4(world - view.anchor, 1.0);
    return (glm::dvec2(clip) * 0.5 + 0.5) * static_cast<double>(view.width_px);
}

double off_grid(double texels) {
    return std::abs(texels - std::round(texels));
}

} // namespace

TEST_CASE("cascades: texels keep their places in the world, however the camera moves and turns") {
    const glm::dvec3 place(3.0, 0.4, 9.0);
    for (const int size_px : {2048, 1000, 17}) {
        const assets::Shadow shadow = square(size_px);
        const View first = camera({0.0, 1.5, 0.0}, {5.0, 1.0, 8.0});
        for (int cascade = 1; cascade < max_cascades; ++cascade) {
            const View before = cascade_at(shadow, first, cascade);
            for (int i = 1; i < 60; ++i) {
                const double angle = 0.11 * i;
                const glm::dvec3 eye(0.13 * i, 1.5 + 0.01 * i, 0.07 * i);
                const View now = cascade_at(
                    shadow, camera(eye, eye + glm::dvec3(std::sin(angle), -0.2, std::cos(angle))), cascade);
                CHECK(now.projection[0][0] == doctest::Approx(before.projection[0][0]).epsilon(1e-5));
                const glm::dvec2 moved = texel(now, place) - texel(before, place);
                CHECK(off_grid(moved.x) < 0.02);
                CHECK(off_grid(moved.y) < 0.02);
            }
        }
    }
}

TEST_CASE("cascades: most frames of a slow flight find each of them drawn") {
    const assets::Shadow shadow = square();
    for (int cascade = 1; cascade < max_cascades; ++cascade) {
        int redrawn = 0;
        glm::mat4 before(0.0F);
        for (int frame = 0; frame < 300; ++frame) { // ten seconds at 1 m/s
            const glm::dvec3 eye(frame / 30.0, 1.5, 0.0);
            const View now = cascade_at(shadow, camera(eye, eye + glm::dvec3(1.0, 0.0, 0.3)), cascade);
            redrawn += now.view_projection == before ? 0 : 1;
            before = now.view_projection;
        }
        CHECK(redrawn > 1); // it follows
        CHECK(redrawn < 20);
    }
}

TEST_CASE("cascades: each contains the camera's near slice, three times as deep as that of the next") {
    const assets::Shadow shadow = square();
    double depth_m = 5.0;
    for (int cascade = max_cascades - 1; cascade > 0; --cascade, depth_m *= cascade_ratio) {
        for (int i = 0; i < 24; ++i) {
            const double angle = 0.26 * i;
            const glm::dvec3 eye(2.0 + 0.37 * i, 1.5, 10.0);
            const View main = camera(eye, eye + glm::dvec3(std::sin(angle), 0.1, std::cos(angle)));
            const View view = cascade_at(shadow, main, cascade);
            const glm::mat4 world_of_clip = glm::inverse(main.view_projection);
            for (const glm::vec2 corner :
                 {glm::vec2(-1, -1), glm::vec2(1, -1), glm::vec2(-1, 1), glm::vec2(1)}) {
                const glm::vec4 far = world_of_clip * glm::vec4(corner, 1.0F, 1.0F);
                const glm::dvec3 ray = glm::dvec3(far) / static_cast<double>(far.w) - eye;
                const glm::dvec3 forward = -glm::dvec3(glm::transpose(glm::mat3(main.view))[2]);
                const glm::dvec2 at = texel(view, eye + ray * (depth_m / glm::dot(ray, forward)));
                CHECK(at.x >= 0.0);
                CHECK(at.y >= 0.0);
                CHECK(at.x <= view.width_px);
                CHECK(at.y <= view.width_px);
            }
        }
    }
}

TEST_CASE("cascades: the fit finds a point where the cascade's own view does, and its texels' size") {
    const assets::Shadow shadow = square();
    const View main = camera({20.0, 1.5, 5.0}, {25.0, 1.0, 9.0});
    const View light = light_view(shadow, sun, main.anchor);
    const glm::dvec3 place(22.0, 0.7, 6.0);
    const glm::dvec2 whole = texel(light, place) / 2048.0;
    double texel_m = 110.0 / 2048.0;
    for (int cascade = 0; cascade < max_cascades; ++cascade, texel_m /= cascade_ratio) {
        const View view = cascade_view(shadow, light, main, cascade);
        const glm::vec4 fit = cascade_fit(shadow, light, view);
        const glm::dvec2 found = whole * static_cast<double>(fit.x) + glm::dvec2(fit.y, fit.z);
        CHECK(glm::distance(found * 2048.0, texel(view, place)) < 0.02);
        CHECK(fit.w == doctest::Approx(texel_m).epsilon(1e-4));
    }
}

TEST_CASE("cascades: they stay inside the scene's square, wherever the camera is") {
    const assets::Shadow shadow = square();
    for (const glm::dvec3 eye : {glm::dvec3(500.0, 2.0, 0.0), glm::dvec3(-40.0, 90.0, -80.0)}) {
        const View main = camera(eye, eye + glm::dvec3(0.0, -0.1, 1.0));
        const View light = light_view(shadow, sun, main.anchor);
        for (int cascade = 1; cascade < max_cascades; ++cascade) {
            const glm::vec4 fit = cascade_fit(shadow, light, cascade_view(shadow, light, main, cascade));
            for (const float offset : {fit.y, fit.z}) {
                CHECK(-offset / fit.x >= -1e-4F);
                CHECK((1.0F - offset) / fit.x <= 1.0F + 1e-4F);
            }
        }
    }
}
