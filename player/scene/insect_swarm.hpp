#pragma once
// A swarm of insects at a lamp in closed form. Uses no GL.

#include "assets/scene/file.hpp"
#include "scene/random.hpp"

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace paradize {

struct Insect {
    glm::vec3 position{0.0F}; // metres, relative to the field's centre
    float size_m = 0.0F;
    glm::vec3 radiance{0.0F}; // linear, of the lamps' light on it
};

/// Each insect flies a path of its own inside a sphere of the field's radius, and the middle of the sphere
/// wanders up to `wander_m` from the field's centre. Where an insect is depends on the second alone. The
/// swarm is there while a light that reaches its centre is on.
class InsectSwarm {
  public:
    /// `lights`: of the scene; must outlive this object.
    InsectSwarm(const assets::ParticleField &field, std::uint64_t seed,
                std::span<const assets::PointLight> lights);
    /// Sets the insects to how they are `time_s` after the start. `strengths`: of all lights of the scene, 0
    /// to
    /// 1. Allocates nothing.
    void move_to(double time_s, std::span<const float> strengths);
    const std::vector<Insect> &insects() const { return insects_; }
    const glm::dvec3 &center() const { return field_.center; } // in the world
    /// The strength of the brightest light that reaches the centre, 0 to 1. Without lights in the scene: 1.
    float opacity() const { return opacity_; }

  private:
    /// A wave of a path: a direction with an amplitude, turns per second, turns at second 0.
    struct Wave {
        glm::vec3 way{0.0F};
        double turns_per_s = 0.0, phase = 0.0;
    };
    using Path = std::array<Wave, 3>;

    static glm::vec3 at(const Path &path, double time_s);
    static Path path_of(Pcg &random, float reach_m, double turns_per_s);
    glm::vec3 light_at(const glm::vec3 &position, std::span<const float> strengths) const;

    assets::ParticleField field_;
    std::span<const assets::PointLight> lights_;
    std::vector<std::uint32_t> near_; // lights that reach the sphere
    bool waits_for_light_ = false;
    Path wander_;
    std::vector<Path> paths_;
    std::vector<Insect> insects_;
    float opacity_ = 1.0F;
};

} // namespace paradize
