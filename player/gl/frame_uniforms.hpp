#pragma once
// The uniform block that all shaders share: std140, one copy per view and frame. shaders/lib/frame.glsl
// declares the same members in the same order. Program checks their offsets when it links.

#include <glm/mat4x4.hpp>
#include <glm/vec4.hpp>

#include <cstddef>

namespace paradize::gl {

struct FrameUniforms {
    glm::mat4 view_projection;         // clip from world
    glm::mat4 view;                    // eye from world
    glm::mat4 inverse_view_projection; // world from clip
    glm::mat4 shadow_from_world;       // [0,1]^3 of the shadow map from world
    glm::vec4 eye;                     // xyz m, the eye of this view (the mirrored eye in the mirror); w 1
    glm::vec4 clip_plane;              // kept where dot(clip_plane, vec4(p, 1)) >= 0; (0,0,0,1) keeps all
    glm::vec4 viewport;                // width px, height px, 1/width, 1/height
    glm::vec4 lens;                    // near m, far m, pixels per metre at 1 m, 1 when mirrored
    glm::vec4 sun_direction; // xyz unit, from ground to sun or, at night, moon; w angular radius, rad
    glm::vec4 sun_radiance;  // of that light: rgb colour x intensity, linear; w 1 if there is a shadow map
    // rgb colour x intensity, linear; w edge of the area that one shaded sample represents, px
    glm::vec4 ambient;
    glm::vec4 fog;   // rgb linear; w density, 1/m
    glm::vec4 water; // rgb absorption, 1/m; w water level, m (-1e9: no water)
    // x second of the flight, y seconds since the start (float: too coarse for scrolling), z exposure, w
    // frame number modulo 4096
    glm::vec4 clock;
    glm::vec4 anchor;      // xyz floating origin: world position that all coordinates are relative to, m
    glm::vec4 wind;        // scene/wind.hpp: direction
    glm::vec4 wind_phases; // scene/wind.hpp: phases
    glm::vec4 daylight;    // x 0 by day, 1 at night; y how much brighter haze is towards the light, [0,1]
};

static_assert(sizeof(FrameUniforms) == 480);
static_assert(offsetof(FrameUniforms, view) == 64);
static_assert(offsetof(FrameUniforms, inverse_view_projection) == 128);
static_assert(offsetof(FrameUniforms, shadow_from_world) == 192);
static_assert(offsetof(FrameUniforms, eye) == 256);
static_assert(offsetof(FrameUniforms, clip_plane) == 272);
static_assert(offsetof(FrameUniforms, viewport) == 288);
static_assert(offsetof(FrameUniforms, lens) == 304);
static_assert(offsetof(FrameUniforms, sun_direction) == 320);
static_assert(offsetof(FrameUniforms, sun_radiance) == 336);
static_assert(offsetof(FrameUniforms, ambient) == 352);
static_assert(offsetof(FrameUniforms, fog) == 368);
static_assert(offsetof(FrameUniforms, water) == 384);
static_assert(offsetof(FrameUniforms, clock) == 400);
static_assert(offsetof(FrameUniforms, anchor) == 416);
static_assert(offsetof(FrameUniforms, wind) == 432);
static_assert(offsetof(FrameUniforms, wind_phases) == 448);
static_assert(offsetof(FrameUniforms, daylight) == 464);

} // namespace paradize::gl
