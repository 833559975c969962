// The sky of a scene whose light changes with the time of day. Macros: NIGHT 1: with moon and stars; default 0.
#include "lib/daytime_sky.glsl"
#include "lib/fog.glsl"

#ifndef NIGHT
#define NIGHT 0
#endif

uniform vec3 u_sun;      // unit, towards its disc
uniform vec4 u_sun_disc; // radiance; angular radius, rad
#if NIGHT
#include "lib/stars.glsl"
uniform vec3 u_moon;       // unit, towards its disc
uniform vec4 u_moon_disc;  // radiance; angular radius, rad
uniform float u_star_light; // 0 by day, 1 at night
uniform float u_star_area;  // 1; less where the picture is enlarged, so that a star keeps its light
uniform mat3 u_star_turn;  // from directions in the world to those of the stars' sphere
#endif

in vec3 v_ray;

layout(location = 0) out vec4 fragment;

const float MAX_RADIANCE = 60.0;

void main() {
    vec3 direction = safe_normalize(v_ray, vec3(0.0, 1.0, 0.0));
    float pixels_per_rad = max(lens.z, 1.0);
    float towards_light = dot(direction, u_light_direction);
    vec3 clear = clear_sky(direction);
    vec3 color = clear;
    // The mirror view shows neither disc: the water draws their glitter.
    float shown = lens.w > 0.5 ? 0.0 : 1.0;
    float sun_angle = sqrt(max(2.0 - 2.0 * dot(direction, u_sun), 0.0));
    float rim = 1.0 / pixels_per_rad;
    float sun = shown * (1.0 - smoothstep(u_sun_disc.w - rim, u_sun_disc.w + rim, sun_angle));
    vec3 discs = u_sun_disc.rgb * sun;
#if NIGHT
    // Waves spread the light of mirrored stars.
    color += stars(u_star_turn * direction, pixels_per_rad) * (u_star_light * u_star_area * (lens.w > 0.5 ? 0.15 : 1.0));
    vec3 right = safe_normalize(cross(vec3(0.0, 1.0, 0.0), u_moon), vec3(1.0, 0.0, 0.0));
    vec3 off = direction - u_moon;
    vec2 offset = vec2(-dot(off, right), dot(off, cross(u_moon, right))) / max(u_moon_disc.w, 1e-4);
    if (dot(direction, u_moon) > 0.9) {
        vec4 moon = moon_disc(offset, rim / max(u_moon_disc.w, 1e-4)) * shown;
        color *= 1.0 - moon.a * min(u_star_light, 1.0);
        discs += u_moon_disc.rgb * moon.rgb * moon.a;
    }
#endif
    color += light_glow(towards_light) + discs;
    vec4 cloud = clouds(direction, clear, towards_light, pixels_per_rad);
    color = min(mix(color, cloud.rgb, cloud.a), vec3(MAX_RADIANCE));
    color = mix(color, haze_color(direction), haze_amount(haze_path(direction.y)));
    if (eye_in_water()) {
        color = u_water_glow;
    }
    fragment = vec4(color, 1.0);
}
