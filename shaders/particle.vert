#include "lib/clip_vert.glsl"
#include "lib/frame.glsl"
#include "lib/guard.glsl"

layout(location = 6) in vec4 place_and_size; // xyz metres, world; w edge of the quad, metres
layout(location = 7) in vec2 turn_and_life;  // rad; transparency [0,1]

out vec2 v_corner; // [-1,1]
out float v_life;

void main() {
    vec2 corner = vec2((gl_VertexID & 1) == 0 ? -1.0 : 1.0, (gl_VertexID & 2) == 0 ? -1.0 : 1.0);
    v_corner = corner;
    // A sparkle never gets so small that it would flicker between pixels: it grows dimmer instead.
    float pixels = place_and_size.w * lens.z / max(distance(eye.xyz, place_and_size.xyz), 1e-3);
    float grown = max(pixels, 7.0) / max(pixels, 1e-3);
    v_life = turn_and_life.y * safe_pow(grown, -0.8);
    float c = cos(turn_and_life.x);
    float s = sin(turn_and_life.x);
    vec2 turned = vec2(c * corner.x - s * corner.y, s * corner.x + c * corner.y) * 0.5 * place_and_size.w * grown;
    vec3 right = vec3(view[0][0], view[1][0], view[2][0]);
    vec3 up = vec3(view[0][1], view[1][1], view[2][1]);
    vec3 world = place_and_size.xyz + right * turned.x + up * turned.y;
    write_clip(world);
    gl_Position = view_projection * vec4(world, 1.0);
}
