// The environment that surfaces reflect: the sky without discs and stars. Six faces beside each other, +X -X +Y
// -Y +Z -Z.
#include "lib/daytime_sky.glsl"

uniform float u_face_px; // edge of a face
uniform float u_pixels_per_rad;

layout(location = 0) out vec4 fragment;

// From (s, t, 1) on each face, in [-1, 1], to a direction: The Khronos Group, "The OpenGL Graphics System",
// version 3.3, table 3.21.
const mat3 FACE_AXES[6] = mat3[6](
    mat3(0, 0, -1, 0, -1, 0, 1, 0, 0), mat3(0, 0, 1, 0, -1, 0, -1, 0, 0), mat3(1, 0, 0, 0, 0, 1, 0, 1, 0),
    mat3(1, 0, 0, 0, 0, -1, 0, -1, 0), mat3(1, 0, 0, 0, -1, 0, 0, 0, 1), mat3(-1, 0, 0, 0, -1, 0, 0, 0, -1));

void main() {
    float face = clamp(floor(gl_FragCoord.x / u_face_px), 0.0, 5.0);
    vec2 at = (gl_FragCoord.xy - vec2(face * u_face_px, 0.0)) / u_face_px;
    vec3 direction =
        safe_normalize(FACE_AXES[int(face)] * vec3(2.0 * at - 1.0, 1.0), vec3(0.0, 1.0, 0.0));
    float towards_light = dot(direction, u_light_direction);
    vec3 clear = clear_sky(direction);
    vec3 color = clear + light_glow(towards_light);
    vec4 cloud = clouds(direction, clear, towards_light, u_pixels_per_rad);
    fragment = vec4(min(mix(color, cloud.rgb, cloud.a), vec3(60.0)), 1.0);
}
