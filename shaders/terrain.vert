#include "lib/place.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 tangent;
layout(location = 3) in vec2 uv0; // sand: repeats over the terrain
layout(location = 4) in vec2 uv1; // effect: once over the terrain

out vec3 v_position;
out vec3 v_normal;
out vec4 v_tangent;
out vec2 v_uv_sand;
out vec2 v_uv_effect;

void main() {
    v_position = position;
    v_normal = normal;
    v_tangent = tangent;
    v_uv_sand = uv0;
    v_uv_effect = uv1;
    place(position);
}
