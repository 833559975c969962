#include "lib/beam.glsl"
#include "lib/clip_vert.glsl"
#include "lib/frame.glsl"
#include "lib/guard.glsl"

layout(location = 7) in vec4 foot_and_height; // xyz of the light, m; w height of its beam, m
layout(location = 8) in vec3 color;           // linear, of a surface one metre away from the light

out vec3 v_position;
out vec3 v_place; // metres across from its axis, metres above its foot, share of its height
out vec3 v_color;

const float EDGE = 2.5; // half the strip's width, in widths of the beam

void main() {
    float high = (gl_VertexID & 2) == 0 ? 0.0 : 1.0;
    float side = (gl_VertexID & 1) == 0 ? -EDGE : EDGE;
    float height_m = high * foot_and_height.w;
    vec3 axis = foot_and_height.xyz + vec3(0.0, height_m, 0.0);
    vec3 to_eye = eye.xyz - axis;
    // The strip turns about the beam, towards the eye.
    vec3 right = safe_normalize(vec3(to_eye.z, 0.0, -to_eye.x), vec3(1.0, 0.0, 0.0));
    float across_m = side * beam_width(height_m);
    v_place = vec3(across_m, height_m, high);
    v_color = color;
    v_position = axis + right * across_m;
    write_clip(v_position);
    gl_Position = view_projection * vec4(v_position, 1.0);
}
