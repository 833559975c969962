#include "scene/insect_swarm.hpp"

#include <doctest/doctest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <vector>

using namespace paradize;

namespace {

assets::ParticleField field_of(int count) {
    assets::ParticleField field;
    field.center = {3.0, 2.0, -1.0};
    field.radius_m = 0.5F;
    field.wander_m = 0.3F;
    field.count = count;
    field.size_m = {0.01F, 0.02F};
    field.color = {0.5F, 0.4F, 0.3F};
    field.swarm = true;
    return field;
}

glm::vec3 middle_of(const InsectSwarm &swarm) {
    glm::vec3 sum(0.0F);
    for (const Insect &one : swarm.insects()) {
        sum += one.position;
    }
    return sum / static_cast<float>(swarm.insects().size());
}

} // namespace

TEST_CASE("insects: each stays in its sphere, none jumps, and the swarm wanders as a whole") {
    InsectSwarm swarm(field_of(60), 3, {});
    std::vector<Insect> before;
    float farthest_m = 0.0F;
    float fastest_m = 0.0F;
    float strays_m = 0.0F;
    for (int k = 0; k < 3000; ++k) {
        swarm.move_to(0.02 * k, {});
        for (std::size_t i = 0; i < 60; ++i) {
            const glm::vec3 &now = swarm.insects()[i].position;
            farthest_m = std::max(farthest_m, glm::length(now));
            if (!before.empty()) {
                fastest_m = std::max(fastest_m, glm::distance(now, before[i].position));
            }
        }
        before = swarm.insects();
        strays_m = std::max(strays_m, glm::length(middle_of(swarm)));
    }
    CHECK(farthest_m <= 0.8F);
    CHECK(farthest_m > 0.55F);
    CHECK(fastest_m < 0.15F); // 7 m/s
    CHECK(strays_m > 0.12F);
}

TEST_CASE("insects: a second's swarm is the same however it is reached, days later too") {
    InsectSwarm played(field_of(20), 3, {});
    InsectSwarm alone(field_of(20), 3, {});
    for (int k = 0; k <= 90; ++k) {
        played.move_to(1e6 + k / 30.0, {});
    }
    alone.move_to(1e6 + 3.0, {});
    for (std::size_t i = 0; i < 20; ++i) {
        CHECK(played.insects()[i].position == alone.insects()[i].position);
    }
}

TEST_CASE("insects: they are there while a lamp that reaches them is on, and brighter near it") {
    std::array<assets::PointLight, 2> lights;
    lights[0].position = {3.0, 2.0, -0.4};
    lights[0].range_m = 4.0F;
    lights[1].position = {50.0, 2.0, 0.0};
    lights[1].range_m = 4.0F;
    InsectSwarm swarm(field_of(40), 3, lights);
    swarm.move_to(5.0, std::array<float, 2>{0.0F, 1.0F});
    CHECK(swarm.opacity() == 0.0F);
    swarm.move_to(5.0, std::array<float, 2>{0.7F, 0.0F});
    CHECK(swarm.opacity() == 0.7F);
    const auto away = [&](const Insect &one) {
        return glm::distance(one.position, glm::vec3(0.0F, 0.0F, 0.6F));
    };
    const auto [near, far] = std::ranges::minmax_element(swarm.insects(), {}, away);
    CHECK(near->radiance.x > 1.5F * far->radiance.x);
    CHECK(far->radiance.x > 0.0F);
    lights[0].intensity = 1e6F;
    swarm.move_to(5.0, std::array<float, 2>{1.0F, 0.0F});
    for (const Insect &one : swarm.insects()) {
        CHECK(one.radiance.x == 8.0F);
    }
}
