#include "scene/flight.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace paradize {

namespace {

double cubic(const glm::dvec4 &c, double u) {
    return c.x + u * (c.y + u * (c.z + u * c.w));
}

glm::dvec3 cubic(const std::array<glm::dvec4, 3> &c, double u) {
    return {cubic(c[0], u), cubic(c[1], u), cubic(c[2], u)};
}

/// Returns the spline parameter U at a second of the flight: the whole part is the segment.
double spline_position(const assets::Flight &flight, double second) {
    const std::vector<assets::TimeKnot> &table = flight.time_table;
    const auto after =
        std::upper_bound(table.begin() + 1, table.end() - 1, second,
                         [](double value, const assets::TimeKnot &knot) { return value < knot.time_s; });
    const assets::TimeKnot &b = *after;
    const assets::TimeKnot &a = *(after - 1);
    const double h = b.time_s - a.time_s;
    const double u = std::clamp((second - a.time_s) / h, 0.0, 1.0);
    const double u2 = u * u;
    const double u3 = u2 * u;
    const double spline_u = (2.0 * u3 - 3.0 * u2 + 1.0) * a.position + (u3 - 2.0 * u2 + u) * h * a.speed +
                            (3.0 * u2 - 2.0 * u3) * b.position + (u3 - u2) * h * b.speed;
    return std::clamp(spline_u, 0.0, static_cast<double>(flight.segments.size()));
}

} // namespace

double flight_second(double elapsed_s, double duration_s) {
    double second = std::fmod(elapsed_s, duration_s);
    if (second < 0.0) {
        second += duration_s;
    }
    return second < duration_s ? second : 0.0;
}

Pose flight_pose(const assets::Flight &flight, double time_s) {
    const double spline_u = spline_position(flight, flight_second(time_s, flight.duration_s));
    const std::size_t index = std::min(static_cast<std::size_t>(spline_u), flight.segments.size() - 1);
    const double u = spline_u - static_cast<double>(index);
    const assets::FlightSegment &segment = flight.segments[index];
    return {cubic(segment.eye, u), cubic(segment.target, u), cubic(segment.roll, u)};
}

glm::mat4 view_matrix(const Pose &pose) {
    glm::dvec3 forward = pose.target - pose.eye;
    const double distance = glm::length(forward);
    forward = distance > 1e-9 ? forward / distance : glm::dvec3(0.0, 0.0, -1.0);
    glm::dvec3 up(0.0, 1.0, 0.0);
    if (std::abs(forward.y) > 0.999999) {
        up = glm::dvec3(0.0, 0.0, forward.y > 0.0 ? 1.0 : -1.0);
    }
    glm::dvec3 right = glm::normalize(glm::cross(forward, up));
    up = glm::cross(right, forward);
    const double c = std::cos(pose.roll_rad);
    const double s = std::sin(pose.roll_rad);
    const glm::dvec3 rolled = right * c + up * s;
    up = up * c - right * s;
    right = rolled;
    glm::dmat4 out(1.0);
    for (int i = 0; i < 3; ++i) {
        out[i][0] = right[i];
        out[i][1] = up[i];
        out[i][2] = -forward[i];
    }
    out[3] =
        glm::dvec4(-glm::dot(right, pose.eye), -glm::dot(up, pose.eye), glm::dot(forward, pose.eye), 1.0);
    return glm::mat4(out);
}

} // namespace paradize
