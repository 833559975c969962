#include "lib/position.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 tangent;
layout(location = 3) in vec2 uv0;

uniform mat4 u_model;  // world from mesh: rotation, uniform scale, translation
uniform float u_scale; // the uniform scale of u_model

out vec3 v_position;
out vec3 v_normal;
out vec4 v_tangent;
out vec2 v_uv;

void main() {
    mat3 rotation = mat3(u_model) / max(u_scale, 1e-37);
    v_position = (u_model * vec4(position, 1.0)).xyz;
    v_normal = rotation * normal;
    v_tangent = vec4(rotation * tangent.xyz, tangent.w);
    v_uv = uv0;
    write_position(v_position);
}
