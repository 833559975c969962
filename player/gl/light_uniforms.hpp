#pragma once
// The uniform block of the lights that reach what is drawn: std140, an array of light sets.
// shaders/lib/point_lights.glsl declares their members in the same order. Program checks their offsets
// when it links.

#include <glm/vec4.hpp>

#include <array>
#include <cstddef>

namespace paradize::gl {

struct LightUniforms {
    static constexpr std::size_t most = 16;

    glm::vec4 state{0.0F};               // x number of lights; y strength of what the surface gives off
    std::array<glm::vec4, most> place{}; // xyz in the view's coordinates, m; w range, m
    std::array<glm::vec4, most> color{}; // rgb linear, of a surface one metre away; w radius, m

    bool operator==(const LightUniforms &) const = default;
};

static_assert(sizeof(LightUniforms) == 528);
static_assert(offsetof(LightUniforms, place) == 16);
static_assert(offsetof(LightUniforms, color) == 272);

} // namespace paradize::gl
