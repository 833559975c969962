// Draws depth only, for the light's view.
#include "lib/frame.glsl"

layout(location = 0) in vec3 position;
layout(location = 3) in vec2 uv0;

uniform mat4 u_model; // world from mesh

out vec2 v_uv;

void main() {
    v_uv = uv0;
    gl_Position = view_projection * (u_model * vec4(position, 1.0));
}
