#include "lib/clip_vert.glsl"
#include "lib/frame.glsl"
#include "lib/fullscreen.glsl"

out vec3 v_ray; // from the eye, world space, not unit

void main() {
    vec2 corner = fullscreen_corner(gl_VertexID);
    gl_Position = vec4(corner, 1.0, 1.0); // at the far plane
    vec4 far_point = inverse_view_projection * vec4(corner, 1.0, 1.0);
    vec4 near_point = inverse_view_projection * vec4(corner, -1.0, 1.0);
    v_ray = far_point.xyz / far_point.w - near_point.xyz / near_point.w;
    write_clip(vec3(0.0, 1e9, 0.0));
}
