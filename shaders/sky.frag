#include "lib/fog.glsl"

uniform samplerCube u_sky;
uniform float u_limit; // radiance above which the sky is cut: in the mirror the water draws the sun itself

in vec3 v_ray;

layout(location = 0) out vec4 fragment;

void main() {
    vec3 direction = safe_normalize(v_ray, vec3(0.0, 1.0, 0.0));
    vec3 color = min(texture(u_sky, direction).rgb, vec3(u_limit));
    color = mix(color, haze_color(direction), haze_amount(haze_path(direction.y)));
    if (eye_in_water()) {
        color = u_water_glow;
    }
    fragment = vec4(color, 1.0);
}
