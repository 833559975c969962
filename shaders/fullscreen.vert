#include "lib/fullscreen.glsl"

out vec2 v_uv; // origin at the bottom left

void main() {
    vec2 corner = fullscreen_corner(gl_VertexID);
    v_uv = 0.5 + 0.5 * corner;
    gl_Position = vec4(corner, 0.0, 1.0);
}
