#include "lib/fog.glsl"

uniform samplerCube u_sky;
// upper limit of the radiance; the mirror view clamps the sun, because the water draws its glitter
uniform float u_max_radiance;

in vec3 v_ray;

layout(location = 0) out vec4 fragment;

void main() {
    vec3 direction = safe_normalize(v_ray, vec3(0.0, 1.0, 0.0));
    vec3 color = min(texture(u_sky, direction).rgb, vec3(u_max_radiance));
    color = mix(color, haze_color(direction), haze_amount(haze_path(direction.y)));
    if (eye_in_water()) {
        color = u_water_glow;
    }
    fragment = vec4(color, 1.0);
}
