// Macros: VERTEX_COLORS 1 if the mesh's colours multiply the material's, 2 if what it gives off too;
// SWAY 1 if wind moves it; BEAT 1 if it has wings or legs that move; SECOND_UV 1 if maps lie on second texture coordinates;
// VERTEX_LIT 1 if light is found at the vertices; default 0.
#include "lib/guard.glsl"
#include "lib/model.glsl"
#include "lib/position.glsl"
#include "lib/zenith.glsl"

#ifndef VERTEX_COLORS
#define VERTEX_COLORS 0
#endif
#ifndef SWAY
#define SWAY 0
#endif
#ifndef SECOND_UV
#define SECOND_UV 0
#endif
#ifndef BEAT
#define BEAT 0
#endif
#ifndef VERTEX_LIT
#define VERTEX_LIT 0
#endif
#ifndef POINT_LIGHTS
#define POINT_LIGHTS 0
#endif
#if SWAY || BEAT || VERTEX_LIT
#include "lib/material.glsl"
#endif
#if POINT_LIGHTS
#include "lib/point_lights.glsl"
#endif
#if VERTEX_LIT
#include "lib/fog.glsl"
#include "lib/light.glsl"
#endif
#if SWAY
#include "lib/wind.glsl"
#endif
#if BEAT
#include "lib/beat.glsl"
#endif

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 tangent;
layout(location = 3) in vec2 uv0;

#if VERTEX_LIT
// H. Gouraud, "Continuous Shading of Curved Surfaces", IEEE Transactions on Computers C-20(6), 1971.
out vec3 v_front; // radiance of a white front and of a white back, as much of it as passes the haze
out vec3 v_back;
out vec3 v_haze;  // radiance of the haze
#else
out vec3 v_position;
out vec3 v_normal;
out vec4 v_tangent;
flat out vec3 v_zenith;
#if POINT_LIGHTS
flat out int v_light_set;
#endif
#endif
out vec2 v_uv;
#if SECOND_UV
layout(location = 4) in vec2 uv1;
out vec2 v_second_uv;
#endif
#if VERTEX_COLORS
layout(location = 5) in vec4 color; // linear
out vec4 v_color;
#endif
#if SWAY
layout(location = 6) in vec2 sway;
#endif

void main() {
    mat3 model = transpose(mat3(model_x.xyz, model_y.xyz, model_z.xyz));
    // Only directions matter here. The largest element becomes 1, so that no product under- or overflows.
    vec3 longest = max(max(abs(model[0]), abs(model[1])), abs(model[2]));
    model /= max(max(max(longest.x, longest.y), longest.z), 1e-37);
    // Normals transform by the inverse transpose, which is the matrix of cofactors over the determinant. A
    // mirrored model has a negative determinant and turns the bitangent round: E. Lengyel, "Foundations of
    // Game Engine Development", volume 1, 2016, sections 1.7.1 and 3.2.2.
    mat3 cofactors = mat3(cross(model[1], model[2]), cross(model[2], model[0]), cross(model[0], model[1]));
    float side = dot(model[0], cofactors[0]) < 0.0 ? -1.0 : 1.0;
    vec3 place = position;
    vec3 upright = normal;
#if BEAT
    beat_wings(place, upright, material.beat.xyz);
#endif
    vec3 world = from_mesh(place);
#if SWAY
    world = in_wind(world, sway, material.wind_reach);
#endif
    vec3 world_normal = side * safe_normalize(cofactors * upright, vec3(0.0, 1.0, 0.0));
#if POINT_LIGHTS
    light_set = int(instance_state.w) % LIGHT_SETS;
#endif
#if VERTEX_LIT
    Surface s = matte_surface(world, world_normal, world_normal, vec3(1.0), sky_zenith());
    s.translucency = material.translucency;
    mat2x3 sides = shade_both_sides(s);
    v_haze = apply_haze(vec3(0.0), world);
    vec3 passes = apply_haze(vec3(1.0), world) - v_haze;
    v_front = min(sides[0] * passes, vec3(60000.0)); // the target's half floats end at 65504
    v_back = min(sides[1] * passes, vec3(60000.0));
#else
#if POINT_LIGHTS
    v_light_set = light_set;
#endif
    v_position = world;
    v_normal = world_normal;
    v_zenith = sky_zenith();
    v_tangent = vec4(safe_normalize(model * tangent.xyz, vec3(1.0, 0.0, 0.0)), side * tangent.w);
#endif
    v_uv = uv0;
#if SECOND_UV
    v_second_uv = uv1;
#endif
#if VERTEX_COLORS
    v_color = color;
#endif
    write_position(world);
}
