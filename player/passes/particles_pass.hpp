#pragma once
// Sparkles in the air, and swarms of insects. A sparkle's life is its transparency and falls at its own rate.
// Below the threshold it is born again elsewhere with a new size and rotation.

#include "assets/scene/file.hpp"
#include "gl/handle.hpp"
#include "gl/program.hpp"
#include "passes/environment_bindings.hpp"
#include "passes/pass.hpp"
#include "scene/insect_swarm.hpp"
#include "scene/random.hpp"

#include <glm/vec3.hpp>

#include <cstdint>
#include <vector>

namespace paradize {

struct Particle {
    glm::vec3 position{0.0F}; // metres, relative to the field's centre
    float size_m = 0.0F;
    float rotation_rad = 0.0F;
    float life = 1.0F;    // 1 at birth
    float opacity = 0.0F; // life, with a short fade-in
    std::uint64_t births = 0;
};

/// One field of sparkles in closed form: where each particle is depends on the second alone, so that no frame
/// needs those before it. A particle lives again and again, as long each time; place, size and rotation of
/// each life are random numbers of field, particle and number of births.
class ParticleSwarm {
  public:
    /// They are at the end of a flight of `duration_s` as they were at its beginning, save those that live
    /// longer than two flights.
    ParticleSwarm(const assets::ParticleField &field, std::uint64_t seed, double duration_s);
    /// Sets the particles to how they are `time_s` after the start, a time not before it. Allocates nothing.
    void move_to(double time_s);
    const std::vector<Particle> &particles() const { return particles_; }
    const glm::dvec3 &center() const { return field_.center; } // in the world
    const glm::vec3 &color() const { return field_.color; }

  private:
    /// The constants of a particle over all its lives, and the random values of the present one.
    struct Lives {
        double per_s = 0.0;      // lives per second
        double phase = 0.0;      // share of a life that is over at second 0
        std::uint64_t count = 0; // lives in a flight, after which they begin anew; 0: never
        glm::vec3 born{0.0F};
        float drift_m_per_s = 0.0F; // upwards
    };
    void respawn(std::size_t index, std::uint64_t births);

    assets::ParticleField field_;
    std::uint64_t seed_;
    std::vector<Lives> lives_;
    std::vector<Particle> particles_;
};

class ParticlesPass : public Pass {
  public:
    explicit ParticlesPass(const PassSetup &setup);
    void update(Frame &frame) override;
    void draw(const Frame &frame, const View &view) override;

  private:
    /// Draws `count` particles of the buffer from `first` on.
    void draw_range(std::size_t first, std::size_t count, bool specks) const;

    gl::Program program_;
    EnvironmentBindings environment_;
    gl::VertexArray quads_;
    gl::Buffer instances_;
    std::vector<ParticleSwarm> sparkles_;
    std::vector<InsectSwarm> insects_;
    std::vector<float> data_; // nine floats per particle: the sparkles, then the insects
    std::size_t sparkle_count_ = 0;
    int speck_location_ = -1;
};

} // namespace paradize
