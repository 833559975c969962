// Macro: NEAR_WAVES 1 has waves lift the surface; default 0.
#include "lib/frame.glsl"

#ifndef NEAR_WAVES
#define NEAR_WAVES 0
#endif
#if NEAR_WAVES
#include "lib/near_waves.glsl"
#endif

layout(location = 0) in vec3 position; // xz: grid around u_center, m; y unused

uniform float u_half_size_m; // the sea extends from -u_half_size_m to u_half_size_m
uniform vec2 u_center;       // x, z

out vec3 v_position;
#if NEAR_WAVES
out vec2 v_tilt; // of the waves that lift it
out vec3 v_calm; // clip x, y, w of the calm surface straight below or above
#endif

void main() {
    vec2 xz = clamp(position.xz + u_center, -u_half_size_m - anchor.xz, u_half_size_m - anchor.xz);
    v_position = vec3(xz.x, water.w, xz.y);
#if NEAR_WAVES
    LiftedPoint lifted = lifted_point(xz);
    v_position += lifted.offset;
    v_tilt = lifted.tilt;
    v_calm = (view_projection * vec4(v_position.x, water.w, v_position.z, 1.0)).xyw;
#endif
    gl_Position = view_projection * vec4(v_position, 1.0);
}
