#include "lib/frame.glsl"

layout(location = 0) in vec3 position; // xz: grid around the eye, m; y unused

uniform float u_half_size_m; // the sea extends from -u_half_size_m to u_half_size_m

out vec3 v_position;

void main() {
    vec2 xz = clamp(position.xz + eye.xz, -u_half_size_m - anchor.xz, u_half_size_m - anchor.xz);
    v_position = vec3(xz.x, water.w, xz.y);
    gl_Position = view_projection * vec4(v_position, 1.0);
}
