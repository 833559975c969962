#include "lib/frame.glsl"
#include "lib/guard.glsl"

// Share of haze between the eye and a point: Beer-Lambert over the distance. Blue light scatters more than red, so
// that what is far turns blue before it turns pale: the aerial perspective of painters, milder than J. Rayleigh's.
vec3 haze_amount(float distance_m) {
    return 1.0 - exp(-min(max(distance_m, 0.0) * fog.w * vec3(0.72, 0.95, 1.28), vec3(60.0)));
}

// Metres of haze that a ray to the sky runs through: it lies thin over the sea, so that only rays close to the
// horizon go far in it.
float haze_path(float rise) { return 10.0 / max(rise, 0.003); }

// Haze is brighter towards the sun, as in I. Quilez, "Better Fog", 2010.
vec3 haze_color(vec3 direction) {
    float towards_sun = max(dot(direction, sun_direction.xyz), 0.0);
    float glow = towards_sun * towards_sun;
    glow *= glow;
    return fog.rgb * (1.0 + 0.35 * glow * glow);
}

// Radiance of endless water around an eye below the surface, and the share of light scattered per metre.
uniform vec3 u_water_glow;
uniform float u_water_scatter;

// Is the eye itself in the water? The mirrored eye of a view from above is below the level, but not in it.
bool eye_in_water() { return eye.y < water.w && lens.w < 0.5; }

// What lies between the eye and a point: air with haze or, for an eye below the surface, water.
vec3 apply_haze(vec3 color, vec3 position) {
    vec3 ray = position - eye.xyz;
    float distance_m = length(ray);
    if (eye_in_water()) {
        vec3 kept = exp(-min((water.rgb + u_water_scatter) * distance_m, vec3(60.0)));
        return mix(u_water_glow, color, kept);
    }
    vec3 direction = distance_m > 1e-6 ? ray / distance_m : vec3(0.0, 0.0, 1.0);
    return mix(color, haze_color(direction), haze_amount(distance_m));
}
