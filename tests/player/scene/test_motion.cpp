// Moving objects are where the pipeline says, at any second, and its tree of boxes follows.

#include "context.hpp"
#include "scene/motion.hpp"
#include "small_scene.hpp"
#include "streaming/scene.hpp"

#include <doctest/doctest.h>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>

#include <cmath>
#include <utility>
#include <vector>

using namespace paradize;

namespace {

/// The stand and the motion of tests/pipeline/scene/test_motion.py.
assets::Placement stand() {
    assets::Placement out;
    out.position = {3.0, 1.0, -2.0};
    out.rotation = glm::dquat(0.972332276859962, 0.05862018220383426, 0.21867748686427324,
                              -0.05756539197675107); // w, x, y, z
    out.scale = glm::dvec3(1.5);
    return out;
}

assets::Motion glide() {
    assets::Motion out;
    out.laps = -3;
    out.radius_m = {6.0, 4.0};
    out.rise_m = 0.5;
    out.bank_rad = glm::pi<double>() / 12.0;
    out.pauses = 4;
    out.pause_share = 0.25;
    out.beat.per_lap = 20;
    out.beat.lift_rad = glm::pi<double>() / 6.0;
    return out;
}

bool near(const glm::dmat4 &a, const glm::dmat4 &b, double limit) {
    double most = 0.0;
    for (int column = 0; column < 4; ++column) {
        most = std::max(most, glm::length(a[column] - b[column]));
    }
    return most < limit;
}

} // namespace

TEST_CASE("motion: an instance is where the pipeline says") {
    const Moved now = moved_at(glide(), stand(), 3, 0.37);
    CHECK(glm::distance(glm::dvec3(now.stand[3]),
                        {1.3020347680126751, 1.563553993618744, -5.577675027659513}) < 1e-6);
    const glm::dquat turned(0.8250459234097616, 0.07025534935706253, -0.5269704057065122,
                            -0.1914826406261541);
    CHECK(near(glm::dmat4(glm::mat3_cast(turned) * 1.5), glm::dmat4(glm::dmat3(now.stand)), 1e-6));
}

TEST_CASE("motion: the end of the flight meets its beginning, without a jump on the way") {
    assets::Motion motion = glide();
    motion.beat.glides = 2;
    motion.beat.glide_share = 0.5;
    CHECK(near(moved_at(motion, stand(), 5, 0.0).stand, moved_at(motion, stand(), 5, 1.0).stand, 1e-9));
    assets::Motion deep = motion;
    std::swap(deep.radius_m.x, deep.radius_m.y);
    CHECK(reach_of(deep) == reach_of(motion));
    constexpr int steps = 20000;
    for (int k = 0; k < steps; ++k) {
        const Moved now = moved_at(motion, stand(), 5, static_cast<double>(k) / steps);
        const Moved next = moved_at(motion, stand(), 5, static_cast<double>(k + 1) / steps);
        REQUIRE(near(now.stand, next.stand, 0.02));
        REQUIRE(std::abs(now.beat.y - next.beat.y) < 0.01F);
        REQUIRE(std::abs(std::sin(now.beat.x) - std::sin(next.beat.x)) < 0.1F);
        REQUIRE(glm::distance(glm::dvec3(now.stand[3]), stand().position) <= reach_of(motion));
    }
}

TEST_CASE("motion: in a pause it stands still, its legs too") {
    assets::Motion motion = glide();
    motion.laps = 1;
    const Moved begun = moved_at(motion, stand(), 0, 0.5);
    const Moved ends = moved_at(motion, stand(), 0, 0.5 + 0.24 / 4.0);
    const Moved gone = moved_at(motion, stand(), 0, 0.5 + 0.6 / 4.0);
    CHECK(near(begun.stand, ends.stand, 1e-9));
    CHECK(begun.beat == ends.beat);
    CHECK_FALSE(near(begun.stand, gone.stand, 0.1));
}

TEST_CASE("motion: the scene moves its instances, and a view finds those that it sees then") {
    if (!test::have_context()) {
        return;
    }
    test::SmallScene small;
    assets::Object &file = small.file.objects[0];
    file.motion = glide();
    file.motion->radius_m = {40.0, 40.0};
    file.instances.assign(60, stand());
    Streamer streamer = small.streamer();
    while (!streamer.upload({.bytes = 1U << 20U})) {
    }
    Scene scene(small.file, streamer);
    View view;
    view.planes[0] = {1.0F, 0.0F, 0.0F, 0.0F}; // sees what lies at positive x
    std::vector<DrawItem> items;
    items.reserve(scene.instance_count());
    for (const double second : {0.0, 1.0, 2.5}) {
        scene.move(second);
        const Object &object = scene.objects()[0];
        std::size_t expected = 0;
        for (const Instance &instance : object.instances) {
            const Moved now = moved_at(*file.motion, file.instances[instance.number], instance.number,
                                       second / small.file.flight.duration_s);
            CHECK(glm::distance(instance.center, glm::dvec3(now.stand * glm::dvec4(file.center, 1.0))) <
                  1e-9);
            CHECK(instance.beat == now.beat);
            expected += view.sees(view.local(instance.center), instance.radius_m) ? 1U : 0U;
        }
        items.clear();
        scene.collect(view, {0.0F, 0.0F, 5.0F}, 400.0F, 1.0F, items);
        std::size_t seen = 0;
        for (const DrawItem &item : items) {
            seen += item.count;
        }
        CHECK(seen == expected);
        CHECK(seen > 0);
        CHECK(seen < file.instances.size());
    }
}
