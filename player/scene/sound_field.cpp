#include "scene/sound_field.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace paradize {

namespace {

/// The sound that arrives from places: power, and power times direction.
struct Arriving {
    double power = 0.0;
    glm::dvec3 flow{0.0};
    double nearest_m = std::numeric_limits<double>::infinity();
};

/// `soft` (m^2) is added to the squared distance, so that a sound that the eye passes through comes from all
/// directions for a moment instead of jumping to the other side.
void add_point(const glm::dvec3 &to, double soft, Arriving &out) {
    const double squared = glm::dot(to, to);
    out.nearest_m = std::min(out.nearest_m, std::sqrt(squared));
    out.power += 1.0 / (squared + soft);
    out.flow += to / ((squared + soft) * std::sqrt(squared + soft));
}

/// The integrals of the same along the segment from a to b, both seen from the eye. With s along it and h the
/// distance of its line: the integral of 1 / (h^2 + s^2) is atan(s / h) / h, that of h / (h^2 + s^2)^(3/2)
/// is s / (h sqrt(h^2 + s^2)), and that of s / (h^2 + s^2)^(3/2) is -1 / sqrt(h^2 + s^2).
void add_segment(const glm::dvec3 &a, const glm::dvec3 &b, double soft, Arriving &out) {
    const double length = glm::length(b - a);
    if (!(length > 0.0)) {
        return;
    }
    const glm::dvec3 along = (b - a) / length;
    const double s0 = glm::dot(a, along);
    const double s1 = s0 + length;
    const glm::dvec3 across = a - s0 * along;
    const double beyond = s0 > 0.0 ? s0 : std::min(s1, 0.0);
    out.nearest_m = std::min(out.nearest_m, std::sqrt(glm::dot(across, across) + beyond * beyond));
    const double h2 = glm::dot(across, across) + soft;
    const double h = std::sqrt(h2);
    const double r0 = std::sqrt(h2 + s0 * s0);
    const double r1 = std::sqrt(h2 + s1 * s1);
    out.power += std::atan2(h * length, h2 + s0 * s1) / h; // the difference of both arctangents
    out.flow += across * ((s1 / r1 - s0 / r0) / h2) + along * (1.0 / r0 - 1.0 / r1);
}

} // namespace

float gain_of_hours(const assets::SoundHours &hours, double elapsed_s, double duration_s) {
    const double span_s = flight_second(hours.off_s - hours.on_s, duration_s);
    const double since_s = flight_second(elapsed_s - hours.on_s, duration_s);
    return static_cast<float>(glm::smoothstep(0.0, 1.0, since_s / hours.fade_s) *
                              glm::smoothstep(0.0, 1.0, (span_s - since_s) / hours.fade_s));
}

HeardSound hear(const assets::Sound &sound, const Pose &pose, double elapsed_s, double duration_s) {
    HeardSound out;
    out.gain = sound.hours ? gain_of_hours(*sound.hours, elapsed_s, duration_s) : 1.0F;
    if (sound.places.empty()) {
        return out;
    }
    const double radius_m = static_cast<double>(sound.radius_m);
    const double soft = 0.25 * radius_m * radius_m;
    Arriving arriving;
    if (sound.places.size() == 1) {
        add_point(sound.places[0] - pose.eye, soft, arriving);
    }
    for (std::size_t i = 1; i < sound.places.size(); ++i) {
        add_segment(sound.places[i - 1] - pose.eye, sound.places[i] - pose.eye, soft, arriving);
    }
    if (!(arriving.power > 0.0)) { // a line of no length
        add_point(sound.places[0] - pose.eye, soft, arriving);
    }
    const double near = radius_m / std::max(arriving.nearest_m, radius_m);
    out.gain *= static_cast<float>(std::pow(near, static_cast<double>(sound.falloff)));
    const glm::vec3 mean(arriving.flow / arriving.power);
    const glm::vec3 seen = glm::mat3(view_matrix(pose)) * mean;
    out.direction = seen / std::max(glm::length(seen), 1.0F);
    return out;
}

} // namespace paradize
