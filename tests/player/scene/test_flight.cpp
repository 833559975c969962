#include "assets/scene/file.hpp"
#include "files.hpp"
#include "scene/flight.hpp"

#include <doctest/doctest.h>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

#include <cmath>

using namespace paradize;

namespace {

assets::Flight flight() {
    return assets::parse_scene(test::SceneText().str(), "scene.json").flight;
}

bool finite(const glm::mat4 &m) {
    for (int i = 0; i < 4; ++i) {
        for (int k = 0; k < 4; ++k) {
            if (!std::isfinite(m[i][k])) {
                return false;
            }
        }
    }
    return true;
}

} // namespace

TEST_CASE("flight: waypoints are reached at the times of the table") {
    const assets::Flight f = flight();
    CHECK(flight_pose(f, 0.0).eye.x == doctest::Approx(0.0));
    CHECK(flight_pose(f, 5.0).eye.x == doctest::Approx(5.0));
    CHECK(flight_pose(f, 2.5).eye.x == doctest::Approx(2.5));
}

TEST_CASE("flight: it loops without a jump, and a week later it is the same") {
    const assets::Flight f = flight();
    const double before = flight_pose(f, f.duration_s - 1e-7).eye.x;
    const double after = flight_pose(f, f.duration_s + 1e-7).eye.x;
    CHECK(std::abs(before - after) < 1e-6);
    const double week = std::floor(7.0 * 86400.0 / f.duration_s) * f.duration_s;
    for (const double t : {0.0, 0.1, 3.3, 9.99}) {
        CHECK(std::abs(flight_pose(f, t).eye.x - flight_pose(f, week + t).eye.x) < 1e-8);
    }
    CHECK(flight_second(-0.25, 10.0) == doctest::Approx(9.75));
    CHECK(flight_second(10.0, 10.0) == 0.0);
    CHECK(flight_second(-1e-17, 10.0) == 0.0); // 10 - 1e-17 is 10
}

TEST_CASE("flight: consecutive samples are close together, also across knots") {
    const assets::Flight f = flight();
    double last = flight_pose(f, 0.0).eye.x;
    for (double t = 0.001; t < 20.0; t += 0.001) {
        const double x = flight_pose(f, t).eye.x;
        CHECK(std::abs(x - last) < 0.0025); // the speed is at most 1 m/s
        last = x;
    }
}

TEST_CASE("flight: its speed does not jump at the seconds of the table") {
    assets::Flight f = flight();
    f.time_table = {{0.0, 0.0, 0.1}, {4.0, 1.0, 0.4}, {10.0, 2.0, 0.1}};
    const auto speed = [&](double second) {
        return (flight_pose(f, second + 1e-4).eye.x - flight_pose(f, second - 1e-4).eye.x) / 2e-4;
    };
    CHECK(speed(4.0 - 1e-3) == doctest::Approx(5.0 * 0.4).epsilon(0.01)); // a segment is 5 m long
    CHECK(std::abs(speed(4.0 + 1e-3)) ==
          doctest::Approx(5.0 * 0.4).epsilon(0.01)); // and the second leads back
    CHECK(speed(1e-3) == doctest::Approx(5.0 * 0.1).epsilon(0.05));
}

TEST_CASE("view matrix: the target is in the centre and up points up") {
    const Pose pose{{1.0, 2.0, 3.0}, {4.0, 1.0, -5.0}, 0.0};
    const glm::mat4 view = view_matrix(pose);
    const glm::vec4 target = view * glm::vec4(pose.target, 1.0);
    CHECK(std::abs(target.x) < 1e-5F);
    CHECK(std::abs(target.y) < 1e-5F);
    CHECK(target.z < 0.0F);
    const glm::vec4 above = view * glm::vec4(glm::vec3(pose.target) + glm::vec3(0.0F, 1.0F, 0.0F), 1.0F);
    CHECK(above.y > 0.5F);
}

TEST_CASE("view matrix: roll rotates the picture about its centre") {
    Pose pose{{0.0, 0.0, 0.0}, {0.0, 0.0, -1.0}, 0.0};
    pose.roll_rad = 0.5;
    const glm::vec4 right = view_matrix(pose) * glm::vec4(1.0F, 0.0F, 0.0F, 0.0F);
    CHECK(right.x == doctest::Approx(std::cos(0.5)));
    CHECK(right.y == doctest::Approx(-std::sin(0.5)));
}

TEST_CASE("view matrix: down, the top of the picture is north; up, it is south") {
    for (const double way : {-1.0, 1.0}) {
        const glm::mat4 view = view_matrix({{1.0, 2.0, 3.0}, {1.0, 2.0 + way, 3.0}, 0.0});
        CHECK((view * glm::vec4(0.0F, 0.0F, static_cast<float>(way), 0.0F)).y == doctest::Approx(1.0));
        CHECK((view * glm::vec4(1.0F, 0.0F, 0.0F, 0.0F)).x == doctest::Approx(1.0));
    }
}

TEST_CASE("view matrix: an eye at its target and vertical views are finite") {
    CHECK(finite(view_matrix({{1.0, 2.0, 3.0}, {1.0, 2.0, 3.0}, 0.0})));
    CHECK(finite(view_matrix({{1.0, 2.0, 3.0}, {1.0, 9.0, 3.0}, 0.3})));
    CHECK(finite(view_matrix({{1.0, 2.0, 3.0}, {1.0, -9.0, 3.0}, 0.0})));
}
