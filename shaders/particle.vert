#include "lib/clip_vert.glsl"
#include "lib/frame.glsl"
#include "lib/guard.glsl"

layout(location = 7) in vec4 position_and_size; // xyz position, m; w edge of the quad, m
layout(location = 8) in vec2 rotation_and_life; // rotation, rad; opacity [0,1]
layout(location = 9) in vec3 color;             // linear

uniform float u_speck; // 1: an opaque speck; 0: a sparkle that adds light

out vec2 v_corner; // [-1,1]
out float v_life;
out vec3 v_color;

void main() {
    vec2 corner = vec2((gl_VertexID & 1) == 0 ? -1.0 : 1.0, (gl_VertexID & 2) == 0 ? -1.0 : 1.0);
    v_corner = corner;
    v_color = color;
    // Sparkles are at least 7 pixels wide, specks 2, and get dimmer instead of smaller, so that they do not flicker.
    float least = u_speck > 0.5 ? 2.0 : 7.0;
    float pixels = position_and_size.w * lens.z / max(distance(eye.xyz, position_and_size.xyz), 1e-3);
    float magnification = max(pixels, least) / max(pixels, 1e-3);
    v_life = rotation_and_life.y * safe_pow(magnification, u_speck > 0.5 ? -1.6 : -0.8);
    float c = cos(rotation_and_life.x);
    float s = sin(rotation_and_life.x);
    vec2 rotated = vec2(c * corner.x - s * corner.y, s * corner.x + c * corner.y);
    vec2 offset = rotated * 0.5 * position_and_size.w * magnification;
    vec3 right = vec3(view[0][0], view[1][0], view[2][0]);
    vec3 up = vec3(view[0][1], view[1][1], view[2][1]);
    vec3 world = position_and_size.xyz + right * offset.x + up * offset.y;
    write_clip(world);
    gl_Position = view_projection * vec4(world, 1.0);
}
