#include "app/playback.hpp"

#include <doctest/doctest.h>
#include <glm/geometric.hpp>

using namespace paradize;

TEST_CASE(
    "playback: a steered camera is expected to go on as since the last frame, and to look the same way") {
    const Pose before{{1.0, 2.0, 3.0}, {1.0, 2.0, -7.0}, 0.0};
    const Pose now{
        {1.5, 2.0, 2.0}, {9.0, 2.0, 2.0}, 0.25}; // 10 m/s to the right, 20 m/s ahead; it has turned
    const Horizons horizons{1.0, 2.0, 4.0, 16.0};
    const PosesAhead ahead = poses_ahead(now, before, 0.05, horizons);
    for (std::size_t i = 0; i < ahead.size(); ++i) {
        const glm::dvec3 way = glm::dvec3(10.0, 0.0, -20.0) * horizons[i];
        CHECK(glm::distance(ahead[i].eye, now.eye + way) < 1e-9);
        CHECK(glm::distance(ahead[i].target, now.target + way) < 1e-9);
        CHECK(ahead[i].roll_rad == now.roll_rad);
    }
    CHECK(poses_ahead(now, before, 0.0, horizons)[3].eye == now.eye); // no time has passed
}
