#pragma once
// The uniform block of an object's material: std140, one copy per material. shaders/lib/material.glsl
// declares the same members in the same order and says what they mean. Program checks their offsets when it
// links.

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <array>
#include <cstddef>

namespace paradize::gl {

struct alignas(16) MaterialUniforms {
    glm::vec4 base_color{1.0F};
    glm::vec3 emission_color{0.0F};
    float translucency = 0.0F;
    glm::vec4 beat{0.0F};
    glm::vec2 parallax{0.0F};
    glm::vec2 specular_smoothness{0.0F};
    glm::vec2 metalness{0.0F};
    float occlusion_strength = 0.0F;
    float alpha_cutoff = 0.0F;
    glm::vec2 wind_reach{0.0F};
    std::array<float, 12> has_map{}; // has_color ... in the order of assets::ObjectMap; the rest is free

    bool operator==(const MaterialUniforms &) const = default;
};

static_assert(sizeof(MaterialUniforms) == 144);
static_assert(offsetof(MaterialUniforms, emission_color) == 16);
static_assert(offsetof(MaterialUniforms, translucency) == 28);
static_assert(offsetof(MaterialUniforms, beat) == 32);
static_assert(offsetof(MaterialUniforms, parallax) == 48);
static_assert(offsetof(MaterialUniforms, specular_smoothness) == 56);
static_assert(offsetof(MaterialUniforms, metalness) == 64);
static_assert(offsetof(MaterialUniforms, occlusion_strength) == 72);
static_assert(offsetof(MaterialUniforms, alpha_cutoff) == 76);
static_assert(offsetof(MaterialUniforms, wind_reach) == 80);
static_assert(offsetof(MaterialUniforms, has_map) == 88);

} // namespace paradize::gl
