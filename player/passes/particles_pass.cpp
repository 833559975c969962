#include "passes/particles_pass.hpp"

#include "gl/buffer.hpp"
#include "gl/draw.hpp"
#include "scene/repeating.hpp"

#include <epoxy/gl.h>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

namespace paradize {

namespace {

constexpr int floats_per_particle = 9;
constexpr float fade_in_share = 0.12F;     // share of its life during which a new particle fades in
constexpr double most_lives_per_s = 120.0; // shorter lives than a frame cannot be seen

/// Mixes the bits of a number: SplitMix64, G. L. Steele, D. Lea, C. H. Flood, "Fast Splittable Pseudorandom
/// Number Generators", OOPSLA 2014.
std::uint64_t mixed(std::uint64_t value) {
    value += 0x9e3779b97f4a7c15ULL;
    value = (value ^ (value >> 30U)) * 0xbf58476d1ce4e5b9ULL;
    value = (value ^ (value >> 27U)) * 0x94d049bb133111ebULL;
    return value ^ (value >> 31U);
}

} // namespace

ParticleSwarm::ParticleSwarm(const assets::ParticleField &field, std::uint64_t seed, double duration_s)
    : field_(field), seed_(seed), lives_(static_cast<std::size_t>(std::max(field.count, 0))),
      particles_(lives_.size()) {
    Pcg random(seed);
    const double fading = 1.0 - static_cast<double>(field.threshold);
    for (Lives &lives : lives_) {
        const double falling = random.uniform(field.life_per_s.x, field.life_per_s.y);
        lives.per_s =
            whole_cycles_per_s(std::min(falling / std::max(fading, 1e-9), most_lives_per_s), duration_s);
        lives.count = static_cast<std::uint64_t>(std::llround(lives.per_s * duration_s));
        // The first particles start at all ages, so that playback does not begin with a flash.
        lives.phase = random.uniform(0.0F, 1.0F);
    }
    move_to(0.0);
}

void ParticleSwarm::respawn(std::size_t index, std::uint64_t births) {
    Pcg random(mixed(mixed(seed_ << 32U ^ index) + births));
    Particle &particle = particles_[index];
    // Uniform in a ball: picks points of the enclosing cube until one is inside.
    glm::vec3 p;
    do {
        p = {random.uniform(-1.0F, 1.0F), random.uniform(-1.0F, 1.0F), random.uniform(-1.0F, 1.0F)};
    } while (p.x * p.x + p.y * p.y + p.z * p.z > 1.0F);
    lives_[index].born = p * field_.radius_m;
    // Cubed, so that few particles are large.
    const float large = random.uniform(0.0F, 1.0F);
    particle.size_m = field_.size_m.x + (field_.size_m.y - field_.size_m.x) * large * large * large;
    particle.rotation_rad = random.uniform(0.0F, 2.0F * std::numbers::pi_v<float>);
    lives_[index].drift_m_per_s = random.uniform(0.02F, 0.12F);
    particle.births = births;
}

void ParticleSwarm::move_to(double time_s) {
    for (std::size_t i = 0; i < particles_.size(); ++i) {
        const double lived = lives_[i].phase + time_s * lives_[i].per_s;
        const double whole = std::floor(lived);
        const auto over = static_cast<std::uint64_t>(whole);
        const std::uint64_t births = (lives_[i].count > 0 ? over % lives_[i].count : over) + 1;
        Particle &particle = particles_[i];
        if (particle.births != births) {
            respawn(i, births);
        }
        const Lives &lives = lives_[i];
        const auto share = static_cast<float>(lived - whole);
        const float age_s = lives.per_s > 0.0 ? static_cast<float>((lived - whole) / lives.per_s) : 0.0F;
        particle.life = 1.0F - share * (1.0F - field_.threshold);
        particle.position = lives.born + glm::vec3(0.0F, lives.drift_m_per_s * age_s, 0.0F);
        particle.opacity = particle.life * std::clamp((1.0F - particle.life) / fade_in_share, 0.0F, 1.0F);
    }
}

ParticlesPass::ParticlesPass(const PassSetup &setup)
    : program_(setup.shaders, "particle.vert", "particle.frag"), environment_(setup, program_),
      quads_(gl::VertexArray::create()), speck_location_(program_.location("u_speck")) {
    const assets::SceneFile &file = setup.scene.file();
    std::size_t count = 0;
    std::uint64_t seed = 1;
    for (const assets::ParticleField &field : file.particles) {
        if (field.swarm) {
            insects_.emplace_back(field, seed++, file.lights);
        } else {
            sparkles_.emplace_back(field, seed++, file.flight.duration_s);
            sparkle_count_ += static_cast<std::size_t>(field.count);
        }
        count += static_cast<std::size_t>(field.count);
    }
    data_.resize(count * floats_per_particle);
    glBindVertexArray(quads_.name());
    instances_ = gl::make_buffer(GL_ARRAY_BUFFER, std::max<std::size_t>(data_.size(), 1) * sizeof(float),
                                 gl::Usage::streamed);
    glBindVertexArray(0);
}

void ParticlesPass::update(Frame &frame) {
    const View &main = frame.view(ViewKind::main);
    std::size_t at = 0;
    const auto add = [&](const glm::vec3 &place, float size_m, float rotation_rad, float opacity,
                         const glm::vec3 &color) {
        for (float value :
             {place.x, place.y, place.z, size_m, rotation_rad, opacity, color.x, color.y, color.z}) {
            data_[at++] = value;
        }
    };
    for (ParticleSwarm &field : sparkles_) {
        field.move_to(frame.clock.elapsed_s);
        const glm::vec3 center = main.local(field.center());
        for (const Particle &p : field.particles()) {
            add(center + p.position, p.size_m, p.rotation_rad, p.opacity, field.color());
        }
    }
    for (InsectSwarm &swarm : insects_) {
        swarm.move_to(frame.clock.elapsed_s, frame.point_lights.strengths());
        const glm::vec3 center = main.local(swarm.center());
        for (const Insect &one : swarm.insects()) {
            add(center + one.position, one.size_m, 0.0F, swarm.opacity(), one.radiance);
        }
    }
    gl::write_buffer(GL_ARRAY_BUFFER, instances_, 0, std::as_bytes(std::span(data_)));
}

void ParticlesPass::draw_range(std::size_t first, std::size_t count, bool specks) const {
    const std::size_t offset = first * floats_per_particle * sizeof(float);
    constexpr int stride = floats_per_particle * static_cast<int>(sizeof(float));
    gl::attribute_floats(gl::attribute_free, 4, instances_, stride, offset, 1);
    gl::attribute_floats(gl::attribute_free + 1, 2, instances_, stride, offset + 4 * sizeof(float), 1);
    gl::attribute_floats(gl::attribute_free + 2, 3, instances_, stride, offset + 6 * sizeof(float), 1);
    gl::Program::set(speck_location_, specks ? 1.0F : 0.0F);
    gl::draw_vertices(GL_TRIANGLE_STRIP, 4, static_cast<int>(count));
}

void ParticlesPass::draw(const Frame &frame, const View &view) {
    if (view.kind != ViewKind::main && view.kind != ViewKind::mirror) {
        return;
    }
    program_.use();
    environment_.apply(frame, view);
    glBindVertexArray(quads_.name());
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA); // a sparkle's alpha is 0: it adds
    glDepthMask(GL_FALSE);
    glDisable(GL_CULL_FACE);
    if (sparkle_count_ > 0) {
        draw_range(0, sparkle_count_, false);
    }
    std::size_t first = sparkle_count_;
    for (const InsectSwarm &swarm : insects_) {
        if (swarm.opacity() > 0.0F) {
            draw_range(first, swarm.insects().size(), true);
        }
        first += swarm.insects().size();
    }
    glEnable(GL_CULL_FACE);
    glDepthMask(GL_TRUE);
    glBlendFunc(GL_ONE, GL_ZERO);
    glDisable(GL_BLEND);
    glBindVertexArray(0);
}

} // namespace paradize
