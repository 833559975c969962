// Draws depth only, for the light's view. Macros: INSTANCED 1 for instances, 0 for u_model; default 0.
// VERTEX_COLORS, SWAY and BEAT as in object.vert.
#include "lib/frame.glsl"

#ifndef INSTANCED
#define INSTANCED 0
#endif
#ifndef VERTEX_COLORS
#define VERTEX_COLORS 0
#endif
#ifndef SWAY
#define SWAY 0
#endif

layout(location = 0) in vec3 position;
layout(location = 3) in vec2 uv0;

out vec2 v_uv;
out float v_alpha;
#if VERTEX_COLORS
layout(location = 5) in vec4 color;
#endif

#if INSTANCED
#include "lib/model.glsl"
#else
uniform mat4 u_model; // world from mesh
vec3 from_mesh(vec3 p) { return (u_model * vec4(p, 1.0)).xyz; }
#endif

#ifndef BEAT
#define BEAT 0
#endif
#if BEAT
#include "lib/material.glsl"
#include "lib/beat.glsl"
#endif
#if SWAY
#include "lib/wind.glsl"
layout(location = 6) in vec2 sway;
#endif

void main() {
    v_uv = uv0;
#if VERTEX_COLORS
    v_alpha = color.a;
#else
    v_alpha = 1.0;
#endif
    vec3 place = position;
#if BEAT
    vec3 upright = vec3(0.0);
    beat_wings(place, upright, material.beat.xyz);
#endif
    vec3 world = from_mesh(place);
#if SWAY && BEAT
    world = in_wind(world, sway, material.wind_reach);
#elif SWAY
    world = in_wind(world, sway, instance_state.xy);
#endif
    gl_Position = view_projection * vec4(world, 1.0);
}
