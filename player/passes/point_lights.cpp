#include "passes/point_lights.hpp"

#include "gl/buffer.hpp"
#include "gl/program.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <cstring>
#include <limits>

namespace paradize {

static_assert(gl::LightUniforms::most == assets::max_lights_of_a_set);

std::uint32_t light_sets_per_block() {
    constexpr GLint enough = 1 << 16; // what most devices have
    GLint bytes = 0;
    glGetIntegerv(GL_MAX_UNIFORM_BLOCK_SIZE, &bytes);
    return static_cast<std::uint32_t>(std::min(bytes, enough)) / sizeof(gl::LightUniforms);
}

PointLights::PointLights(const assets::SceneFile &file)
    : file_(file), strengths_(file.lights.size()), lit_(file.light_sets.size()),
      anchor_(std::numeric_limits<double>::quiet_NaN()), sets_per_block_(light_sets_per_block()),
      block_bytes_(gl::aligned_uniform_bytes(sets_per_block_ * sizeof(gl::LightUniforms))) {
    if (!file.lights.empty()) {
        blocks_.resize((file.light_sets.size() + sets_per_block_ - 1) / sets_per_block_ * block_bytes_);
        uniforms_ = gl::make_buffer(GL_UNIFORM_BUFFER, blocks_.size(), gl::Usage::streamed);
    }
}

void PointLights::update(const Moment &moment, const glm::dvec3 &anchor) {
    bool changed = anchor != anchor_;
    anchor_ = anchor;
    for (std::size_t i = 0; i < strengths_.size(); ++i) {
        const float now = light_strength(file_.lights[i], i, moment, file_.flight.duration_s);
        changed = changed || now != strengths_[i];
        strengths_[i] = now;
    }
    if (file_.lights.empty() || !changed) {
        return;
    }
    any_shines_ = false;
    for (std::uint32_t s = 0; s < lit_.size(); ++s) {
        const assets::LightSet &set = file_.light_sets[s];
        gl::LightUniforms block;
        std::size_t count = 0;
        for (const std::uint32_t index : set.lights) {
            const assets::PointLight &light = file_.lights[index];
            if (strengths_[index] > 0.0F) {
                block.place[count] = glm::vec4(light.position - anchor, light.range_m);
                block.color[count] =
                    glm::vec4(light.color * (light.intensity * strengths_[index]), light.radius_m);
                ++count;
            }
        }
        block.state =
            glm::vec4(static_cast<float>(count), set.glow ? strengths_[*set.glow] : 1.0F, 0.0F, 0.0F);
        lit_[s] = count > 0 || set.glow ? 1 : 0;
        any_shines_ = any_shines_ || count > 0;
        std::memcpy(blocks_.data() + s / sets_per_block_ * block_bytes_ +
                        s % sets_per_block_ * sizeof(gl::LightUniforms),
                    &block, sizeof block);
    }
    any_lit_ = std::ranges::find(lit_, 1) != lit_.end();
    if (any_lit_) {
        gl::replace_buffer(GL_UNIFORM_BUFFER, uniforms_, blocks_);
    }
}

void PointLights::bind_block(std::uint32_t block) const {
    glBindBufferRange(GL_UNIFORM_BUFFER, gl::light_uniforms_binding, uniforms_.name(),
                      static_cast<GLintptr>(block * block_bytes_),
                      static_cast<GLsizeiptr>(sets_per_block_ * sizeof(gl::LightUniforms)));
}

int PointLights::bind(std::uint32_t set) const {
    bind_block(set / sets_per_block_);
    return static_cast<int>(set % sets_per_block_);
}

std::string point_lights_define(bool on) {
    return on ? "POINT_LIGHTS 1\n#define LIGHT_SETS " + std::to_string(light_sets_per_block())
              : "POINT_LIGHTS 0";
}

} // namespace paradize
