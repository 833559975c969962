#include "passes/particles_pass.hpp"

#include "gl/buffer.hpp"
#include "gl/draw.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

namespace paradize {

namespace {

constexpr int floats_each = 6;
constexpr float fade_in_share = 0.12F; // share of its life during which a new particle fades in

} // namespace

std::uint32_t Pcg::next() {
    const std::uint64_t old = state_;
    state_ = old * 6364136223846793005ULL + increment_;
    const auto shifted = static_cast<std::uint32_t>(((old >> 18U) ^ old) >> 27U);
    const auto rotation = static_cast<std::uint32_t>(old >> 59U);
    return (shifted >> rotation) | (shifted << ((32U - rotation) & 31U));
}

float Pcg::uniform(float low, float high) {
    const float unit = static_cast<float>(next() >> 8U) * (1.0F / 16777216.0F);
    return low + (high - low) * unit;
}

ParticleSwarm::ParticleSwarm(const assets::ParticleField &field, std::uint64_t seed)
    : field_(field), seed_(seed), random_(seed),
      particles_(static_cast<std::size_t>(std::max(field.count, 0))) {
    for (Particle &particle : particles_) {
        // The first particles start at all ages, so that playback does not begin with a flash.
        respawn(particle, random_.uniform(field_.threshold, 1.0F));
    }
}

void ParticleSwarm::respawn(Particle &particle, float life) {
    // Uniform in a ball: picks points of the enclosing cube until one is inside.
    glm::vec3 p;
    do {
        p = {random_.uniform(-1.0F, 1.0F), random_.uniform(-1.0F, 1.0F), random_.uniform(-1.0F, 1.0F)};
    } while (p.x * p.x + p.y * p.y + p.z * p.z > 1.0F);
    particle.position = p * field_.radius_m;
    // Cubed, so that few particles are large.
    const float large = random_.uniform(0.0F, 1.0F);
    particle.size_m = field_.size_m.x + (field_.size_m.y - field_.size_m.x) * large * large * large;
    particle.rotation_rad = random_.uniform(0.0F, 2.0F * std::numbers::pi_v<float>);
    particle.life_per_s = random_.uniform(field_.life_per_s.x, field_.life_per_s.y);
    particle.drift_m_per_s = random_.uniform(0.02F, 0.12F);
    particle.life = life;
    ++particle.births;
}

void ParticleSwarm::step(double seconds) {
    const auto dt = static_cast<float>(seconds);
    for (Particle &particle : particles_) {
        particle.life -= particle.life_per_s * dt;
        particle.position.y += particle.drift_m_per_s * dt;
        if (particle.life < field_.threshold) {
            respawn(particle, 1.0F);
        }
        particle.opacity = particle.life * std::clamp((1.0F - particle.life) / fade_in_share, 0.0F, 1.0F);
    }
}

ParticlesPass::ParticlesPass(const PassSetup &setup)
    : program_(setup.shaders, "particle.vert", "particle.frag"), environment_(setup, program_),
      quads_(gl::VertexArray::create()), color_location_(program_.location("u_color")) {
    std::size_t count = 0;
    std::uint64_t seed = 1;
    for (const assets::ParticleField &field : setup.scene.file().particles) {
        swarms_.emplace_back(field, seed++);
        colors_.push_back(field.color);
        count += swarms_.back().particles().size();
    }
    data_.resize(count * floats_each);
    glBindVertexArray(quads_.name());
    instances_ = gl::make_buffer(GL_ARRAY_BUFFER, std::max<std::size_t>(data_.size(), 1) * sizeof(float),
                                 gl::Usage::streamed);
    glBindVertexArray(0);
}

void ParticlesPass::step(double /*time_s*/) {
    for (ParticleSwarm &swarm : swarms_) {
        swarm.step(step_s);
    }
}

bool ParticlesPass::continue_from(std::span<const std::unique_ptr<Pass>> before) {
    for (const std::unique_ptr<Pass> &pass : before) {
        const auto *other = dynamic_cast<const ParticlesPass *>(pass.get());
        if (other != nullptr && std::ranges::equal(swarms_, other->swarms_, &ParticleSwarm::matches)) {
            swarms_ = other->swarms_;
            return true;
        }
    }
    return false;
}

void ParticlesPass::prepare(Frame &frame) {
    std::size_t at = 0;
    for (const ParticleSwarm &swarm : swarms_) {
        const glm::vec3 center = frame.view(ViewKind::main).local(swarm.center());
        for (const Particle &p : swarm.particles()) {
            const glm::vec3 place = center + p.position;
            for (float value : {place.x, place.y, place.z, p.size_m, p.rotation_rad, p.opacity}) {
                data_[at++] = value;
            }
        }
    }
    gl::write_buffer(GL_ARRAY_BUFFER, instances_, 0, std::as_bytes(std::span(data_)));
}

void ParticlesPass::draw(const Frame &frame, const View &view) {
    if (view.kind != ViewKind::main && view.kind != ViewKind::mirror) {
        return;
    }
    program_.use();
    environment_.apply(frame, view);
    glBindVertexArray(quads_.name());
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE); // additive
    glDepthMask(GL_FALSE);
    glDisable(GL_CULL_FACE);
    std::size_t first = 0;
    for (std::size_t i = 0; i < swarms_.size(); ++i) {
        const std::size_t count = swarms_[i].particles().size();
        const std::size_t offset = first * floats_each * sizeof(float);
        constexpr int stride = floats_each * static_cast<int>(sizeof(float));
        gl::attribute_floats(gl::attribute_free, 4, instances_, stride, offset, 1);
        gl::attribute_floats(gl::attribute_free + 1, 2, instances_, stride, offset + 4 * sizeof(float), 1);
        gl::Program::set(color_location_, colors_[i]);
        gl::draw_vertices(GL_TRIANGLE_STRIP, 4, static_cast<int>(count));
        first += count;
    }
    glEnable(GL_CULL_FACE);
    glDepthMask(GL_TRUE);
    glBlendFunc(GL_ONE, GL_ZERO);
    glDisable(GL_BLEND);
    glBindVertexArray(0);
}

} // namespace paradize
