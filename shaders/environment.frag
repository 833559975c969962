// One face of the environment that surfaces reflect: the sky without discs and stars.
#include "lib/daytime_sky.glsl"

uniform mat3 u_face; // from (s, t, 1) of the face in [-1,1] to a direction
uniform float u_pixels_per_rad;

in vec2 v_uv;

layout(location = 0) out vec4 fragment;

void main() {
    vec3 direction = safe_normalize(u_face * vec3(2.0 * v_uv - 1.0, 1.0), vec3(0.0, 1.0, 0.0));
    float towards_light = dot(direction, u_light_direction);
    vec3 clear = clear_sky(direction);
    vec3 color = clear + light_glow(towards_light);
    vec4 cloud = clouds(direction, clear, towards_light, u_pixels_per_rad);
    fragment = vec4(min(mix(color, cloud.rgb, cloud.a), vec3(60.0)), 1.0);
}
