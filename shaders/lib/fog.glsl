#include "lib/frame.glsl"
#include "lib/guard.glsl"

// Share of haze between the eye and a point, by Beer-Lambert. Blue scatters more than red, so that distant
// surfaces turn blue before they turn pale.
vec3 haze_per_m() { return fog.w * vec3(0.72, 0.95, 1.28); }
vec3 haze_amount(float distance_m) {
    return 1.0 - exp(-min(max(distance_m, 0.0) * haze_per_m(), vec3(60.0)));
}

// Length of a sky ray inside the haze, metres. The haze is a thin layer, so that only rays near the horizon
// pass through much of it.
float haze_path(float rise) { return 10.0 / max(rise, 0.003); }

// Colour of the haze, brighter towards the sun: I. Quilez, "Better Fog", 2010.
vec3 haze_color(vec3 direction) {
    float towards_sun = max(dot(direction, sun_direction.xyz), 0.0);
    float glow = towards_sun * towards_sun;
    glow *= glow;
    return fog.rgb * (1.0 + 0.35 * daylight.y * glow * glow);
}

// Radiance of endless water around an eye below the surface, and the share of light that water scatters per
// metre.
uniform vec3 u_water_glow;
uniform float u_water_scatter;

// True if the eye is under water. The mirror view's eye lies below the level, but is not under water.
bool eye_in_water() { return eye.y < water.w && lens.w < 0.5; }

// Applies haze between the eye and a point, or water if the eye is under water.
vec3 apply_haze(vec3 color, vec3 position) {
    vec3 ray = position - eye.xyz;
    float distance_m = length(ray);
    vec3 direction = distance_m > 1e-6 ? ray / distance_m : vec3(0.0, 0.0, 1.0);
    bool in_water = eye_in_water();
    // One exponential for both, because software rasterisers compute both sides of a branch.
    vec3 thickness = (in_water ? water.rgb + u_water_scatter : haze_per_m()) * distance_m;
    vec3 between = in_water ? u_water_glow : haze_color(direction);
    return mix(between, color, exp(-min(thickness, vec3(60.0))));
}
