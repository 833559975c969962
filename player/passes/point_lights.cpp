#include "passes/point_lights.hpp"

#include "gl/buffer.hpp"
#include "gl/program.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <cstring>

namespace paradize {

static_assert(gl::LightUniforms::most == assets::max_lights_of_a_set);

PointLights::PointLights(const assets::SceneFile &file)
    : file_(file), strengths_(file.lights.size()), lit_(file.light_sets.size()),
      set_bytes_(gl::aligned_uniform_bytes(sizeof(gl::LightUniforms))) {
    if (!file.lights.empty()) {
        written_.resize(file.light_sets.size() * set_bytes_);
        next_.resize(written_.size());
        uniforms_ = gl::make_buffer(GL_UNIFORM_BUFFER, written_.size(), gl::Usage::streamed);
    }
}

void PointLights::update(const Moment &moment, const glm::dvec3 &anchor) {
    if (file_.lights.empty()) {
        return;
    }
    const auto state_of = [&](std::uint32_t set) {
        glm::vec4 state;
        std::memcpy(&state, next_.data() + set * set_bytes_ + offsetof(gl::LightUniforms, state),
                    sizeof state);
        return state;
    };
    for (std::size_t i = 0; i < strengths_.size(); ++i) {
        strengths_[i] = light_strength(file_.lights[i], i, moment, file_.flight.duration_s);
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
        lit_[s] = count > 0 || set.glow ? s : 0;
        any_shines_ = any_shines_ || count > 0;
        for (std::uint32_t first = 1; count == 0 && first < lit_[s]; ++first) {
            if (lit_[first] == first && state_of(first) == block.state) {
                lit_[s] = first;
            }
        }
        std::memcpy(next_.data() + s * set_bytes_, &block, sizeof block);
    }
    any_lit_ = std::ranges::any_of(lit_, [](std::uint32_t lit) { return lit != 0; });
    if (any_lit_ && written_ != next_) {
        gl::replace_buffer(GL_UNIFORM_BUFFER, uniforms_, next_);
        written_ = next_;
    }
}

void PointLights::bind(std::uint32_t set) const {
    glBindBufferRange(GL_UNIFORM_BUFFER, gl::light_uniforms_binding, uniforms_.name(),
                      static_cast<GLintptr>(set * set_bytes_), sizeof(gl::LightUniforms));
}

std::string point_lights_define(bool on) {
    return on ? "POINT_LIGHTS 1" : "POINT_LIGHTS 0";
}

} // namespace paradize
