#include "lib/fog.glsl"

uniform samplerCube u_sky;

const float MAX_RADIANCE = 60.0;
// Cosine and sine of 1 degree: skies draw the sun's disc about twice as wide as it is.
const vec2 SUN_RIM = vec2(0.99984770, 0.01745241);

// Radiance beside the sun's disc, in the direction of its rim that is nearest.
vec3 beside_sun(vec3 across) {
    vec3 side = safe_normalize(across, vec3(0.0, 1.0, 0.0));
    return textureLod(u_sky, sun_direction.xyz * SUN_RIM.x + side * SUN_RIM.y, 0.0).rgb;
}

in vec3 v_ray;

layout(location = 0) out vec4 fragment;

void main() {
    vec3 direction = safe_normalize(v_ray, vec3(0.0, 1.0, 0.0));
    vec3 color = texture(u_sky, direction).rgb;
    // The mirror view shows the sky without the sun, whose glitter the water draws.
    float towards_sun = dot(direction, sun_direction.xyz);
    if (lens.w > 0.5 && towards_sun > SUN_RIM.x) {
        color = beside_sun(direction - sun_direction.xyz * towards_sun);
    }
    color = min(color, vec3(MAX_RADIANCE));
    color = mix(color, haze_color(direction), haze_amount(haze_path(direction.y)));
    if (eye_in_water()) {
        color = u_water_glow;
    }
    fragment = vec4(color, 1.0);
}
