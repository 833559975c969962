#include "scene/ripples.hpp"

#include <doctest/doctest.h>
#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>

using namespace paradize;

namespace {

assets::SceneFile sea(int circles) {
    assets::SceneFile file;
    file.flight.duration_s = 240.0;
    file.water.emplace();
    file.water->ripple_height_m = 0.05F;
    for (int i = 0; i < circles; ++i) {
        file.water->ripples.push_back({static_cast<double>(i), -6.0, 0.1F});
    }
    return file;
}

View eye_at(const glm::dvec3 &anchor = glm::dvec3(0.0)) {
    View view;
    view.anchor = anchor;
    view.eye = glm::vec3(glm::dvec3(0.0, 2.0, 0.0) - anchor);
    return view;
}

} // namespace

TEST_CASE("ripples: none without circles, all where there are few, and they repeat with the flight") {
    CHECK(ripples_at(sea(0), 1.0, eye_at()).count == 0);
    const Ripples first = ripples_at(sea(3), 12.5, eye_at());
    CHECK(first.count == 3);
    CHECK(first.rings[0].w > 0.0F);
    const Ripples later = ripples_at(sea(3), 12.5 + 240.0, eye_at());
    CHECK(first.rings == later.rings);
    CHECK(first.phase == later.phase);
    CHECK(ripples_at(sea(3), 12.6, eye_at()).phase != first.phase);
}

TEST_CASE("ripples: they close with the flight, however long it is") {
    assets::SceneFile file = sea(7);
    for (const double duration_s : {240.0, 241.7, 3.3}) {
        file.flight.duration_s = duration_s;
        const Ripples last = ripples_at(file, duration_s - 1e-6, eye_at());
        const Ripples first = ripples_at(file, 0.0, eye_at());
        CHECK(std::cos(last.phase - first.phase) == doctest::Approx(1.0));
        for (std::size_t i = 0; i < 7; ++i) {
            CHECK(last.rings[i].w == doctest::Approx(first.rings[i].w).epsilon(1e-4));
        }
    }
}

TEST_CASE("ripples: of many circles the nearest, and the last has faded out before another takes its place") {
    const Ripples many = ripples_at(sea(30), 1.0, eye_at());
    REQUIRE(many.count == most_rings);
    for (int i = 0; i < most_rings; ++i) {
        CHECK(many.rings[static_cast<std::size_t>(i)].x == static_cast<float>(i));
    }
    CHECK(many.rings.back().w == 0.0F);
    CHECK(many.rings.front().w > 0.05F);
}

TEST_CASE("ripples: the floating origin leaves them in their places") {
    const glm::dvec3 anchor(1000.0, 0.0, -70.0);
    const Ripples far = ripples_at(sea(1), 1.0, eye_at(anchor));
    CHECK(far.rings[0].x == -1000.0F);
    CHECK(far.rings[0].y == 64.0F);
}
