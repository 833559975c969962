#include "lib/guard.glsl"
#include "lib/position.glsl"
#include "lib/zenith.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 tangent;
layout(location = 3) in vec2 uv0; // sand, repeats over the terrain
layout(location = 4) in vec2 uv1; // effect map, once over the terrain

#ifndef POINT_LIGHTS
#define POINT_LIGHTS 0
#endif
#if POINT_LIGHTS
layout(location = 7) in float light_set; // in the bound block
flat out int v_light_set;
#endif

uniform mat4 u_model;         // world from mesh; positions may be quantised
uniform mat3 u_normal_matrix; // inverse transpose of u_model, for normals

out vec3 v_position;
out vec3 v_normal;
out vec4 v_tangent;
out vec2 v_uv_sand;
out vec2 v_uv_effect;
flat out vec3 v_zenith;
flat out vec3 v_sand_mean; // linear colour of all the sand

uniform sampler2D u_sand_color;

void main() {
#if POINT_LIGHTS
    v_light_set = int(light_set);
#endif
    v_position = (u_model * vec4(position, 1.0)).xyz;
    v_normal = safe_normalize(u_normal_matrix * normal, vec3(0.0, 1.0, 0.0));
    v_tangent = vec4(safe_normalize(mat3(u_model) * tangent.xyz, vec3(1.0, 0.0, 0.0)), tangent.w);
    v_uv_sand = uv0;
    v_uv_effect = uv1;
    v_zenith = sky_zenith();
    v_sand_mean = textureLod(u_sand_color, uv0, 16.0).rgb;
    write_position(v_position);
}
