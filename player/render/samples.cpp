#include "render/samples.hpp"

#include <glm/geometric.hpp>

#include <cmath>
#include <numbers>

namespace paradize {

namespace {

/// Mirrors the digits of `index` in base `base` at the point. The result lies in [0, 1).
double radical_inverse(int index, int base) {
    double out = 0.0;
    double digit = 1.0;
    for (; index > 0; index /= base) {
        digit /= base;
        out += digit * (index % base);
    }
    return out;
}

glm::vec2 disc(double u, double v) {
    const double x = 2.0 * u - 1.0;
    const double y = 2.0 * v - 1.0;
    if (x == 0.0 && y == 0.0) {
        return glm::vec2(0.0F);
    }
    const bool wide = std::abs(x) > std::abs(y);
    const double quarter = std::numbers::pi / 4.0;
    const double radius = wide ? x : y;
    const double angle = wide ? quarter * (y / x) : 2.0 * quarter - quarter * (x / y);
    return glm::vec2(radius * std::cos(angle), radius * std::sin(angle));
}

} // namespace

std::vector<Sample> reference_samples(int count) {
    std::vector<Sample> out(static_cast<std::size_t>(count));
    Sample mean;
    for (int i = 0; i < count; ++i) {
        Sample &sample = out[static_cast<std::size_t>(i)];
        sample.pixel = glm::vec2(radical_inverse(i + 1, 2) - 0.5, radical_inverse(i + 1, 3) - 0.5);
        sample.sun = disc(radical_inverse(i + 1, 5), radical_inverse(i + 1, 7));
        mean.pixel += sample.pixel / static_cast<float>(count);
        mean.sun += sample.sun / static_cast<float>(count);
    }
    for (Sample &sample : out) {
        sample.pixel -= mean.pixel;
        sample.sun -= mean.sun;
    }
    return out;
}

glm::vec3 sun_direction(const glm::vec3 &to_sun, float angular_radius_rad, const glm::vec2 &disc_point) {
    const glm::vec3 side =
        std::abs(to_sun.y) < 0.9F ? glm::vec3(0.0F, 1.0F, 0.0F) : glm::vec3(1.0F, 0.0F, 0.0F);
    const glm::vec3 right = glm::normalize(glm::cross(side, to_sun));
    const glm::vec3 up = glm::cross(to_sun, right);
    const float reach = std::tan(angular_radius_rad);
    return glm::normalize(to_sun + (right * disc_point.x + up * disc_point.y) * reach);
}

} // namespace paradize
