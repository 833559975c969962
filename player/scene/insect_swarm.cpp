#include "scene/insect_swarm.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>

#include <algorithm>
#include <cmath>

namespace paradize {

namespace {

// Along three directions at right angles. Their squares add up to less than 1, so that no path leaves its
// sphere.
constexpr std::array<float, 3> amplitudes{0.8F, 0.5F, 0.32F};
// Of the three waves, relative to the first. They have no common multiple, so that a path never repeats.
constexpr std::array<double, 3> rates{1.0, 1.618, 2.414};
constexpr double wanders_per_s = 0.047;
constexpr double darts = 0.11; // turns by which an insect runs ahead of an even flight, and falls back
constexpr float most_radiance = 8.0F;

double wave(double turns) {
    return std::sin(glm::two_pi<double>() * (turns - std::floor(turns)));
}

glm::vec3 direction(Pcg &random) {
    glm::vec3 p;
    do {
        p = {random.uniform(-1.0F, 1.0F), random.uniform(-1.0F, 1.0F), random.uniform(-1.0F, 1.0F)};
    } while (glm::dot(p, p) > 1.0F || glm::dot(p, p) < 0.01F);
    return glm::normalize(p);
}

} // namespace

InsectSwarm::Path InsectSwarm::path_of(Pcg &random, float reach_m, double turns_per_s) {
    const glm::vec3 first = direction(random);
    glm::vec3 second = direction(random);
    while (std::abs(glm::dot(first, second)) > 0.9F) {
        second = direction(random);
    }
    second = glm::normalize(second - first * glm::dot(first, second));
    const std::array<glm::vec3, 3> ways{first, second, glm::cross(first, second)};
    Path path;
    for (std::size_t k = 0; k < path.size(); ++k) {
        path[k] = {ways[k] * (reach_m * amplitudes[k]), turns_per_s * rates[k],
                   static_cast<double>(random.uniform(0.0F, 1.0F))};
    }
    return path;
}

glm::vec3 InsectSwarm::at(const Path &path, double time_s) {
    glm::vec3 out(0.0F);
    for (const Wave &one : path) {
        const double turns = one.turns_per_s * time_s + one.phase;
        out += one.way * static_cast<float>(wave(turns + darts * wave(2.3 * turns)));
    }
    return out;
}

InsectSwarm::InsectSwarm(const assets::ParticleField &field, std::uint64_t seed,
                         std::span<const assets::PointLight> lights)
    : field_(field), lights_(lights), waits_for_light_(!lights.empty()),
      paths_(static_cast<std::size_t>(std::max(field.count, 0))), insects_(paths_.size()) {
    Pcg random(seed);
    wander_ = path_of(random, field.wander_m, wanders_per_s);
    for (std::size_t i = 0; i < paths_.size(); ++i) {
        paths_[i] = path_of(random, field.radius_m, static_cast<double>(random.uniform(0.15F, 0.5F)));
        insects_[i].size_m = random.uniform(field.size_m.x, field.size_m.y);
    }
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const auto away_m = static_cast<float>(glm::distance(lights[i].position, field.center));
        if (away_m < lights[i].range_m + field.radius_m + field.wander_m) {
            near_.push_back(static_cast<std::uint32_t>(i));
        }
    }
}

glm::vec3 InsectSwarm::light_at(const glm::vec3 &position, std::span<const float> strengths) const {
    glm::vec3 sum(0.0F);
    for (const std::uint32_t index : near_) {
        const assets::PointLight &light = lights_[index];
        const glm::vec3 way = glm::vec3(light.position - field_.center) - position;
        const float squared = glm::dot(way, way);
        const float share = squared / (light.range_m * light.range_m);
        const float window = std::clamp(1.0F - share * share, 0.0F, 1.0F);
        const float falloff = window * window / std::max(squared, light.radius_m * light.radius_m);
        sum += light.color * (light.intensity * strengths[index] * falloff);
    }
    return sum;
}

void InsectSwarm::move_to(double time_s, std::span<const float> strengths) {
    opacity_ = waits_for_light_ ? 0.0F : 1.0F;
    for (const std::uint32_t index : near_) {
        opacity_ = std::max(opacity_, strengths[index]);
    }
    if (opacity_ == 0.0F) {
        return;
    }
    const glm::vec3 middle = at(wander_, time_s);
    for (std::size_t i = 0; i < insects_.size(); ++i) {
        insects_[i].position = middle + at(paths_[i], time_s);
        const glm::vec3 light = light_at(insects_[i].position, strengths) * glm::one_over_pi<float>();
        insects_[i].radiance = glm::min(field_.color * light, glm::vec3(most_radiance));
    }
}

} // namespace paradize
