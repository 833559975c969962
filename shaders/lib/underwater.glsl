// Light below the water's surface.
#include "lib/frame.glsl"
#include "lib/waves.glsl"

uniform float u_caustics;      // strength, 0 without water
uniform vec3 u_sun_refracted;  // unit, from the floor towards the sun inside the water

// Share of the sun's light that reaches `depth` metres along the refracted ray.
vec3 sun_through_water(float depth) {
    return exp(-min(water.rgb * max(depth, 0.0) / max(u_sun_refracted.y, 0.2), vec3(60.0)));
}

// Light gathered and spread by the waves above a point: a ray that meets slope s is bent sideways by about
// depth * (1 - 1/1.33) * s, so brightness is the inverse of how much a small patch of rays is stretched:
// D. Guardado, D. Sanchez-Crespo, "Rendering Water Caustics", GPU Gems, 2004, in its one-sided form.
float caustics(vec3 position, float depth) {
    vec2 above = position.xz + u_sun_refracted.xz * (depth / max(u_sun_refracted.y, 0.2));
    float reach = 0.35;
    vec2 here = wave_tilt(0, above) + wave_tilt(1, above);
    vec2 east = wave_tilt(0, above + vec2(reach, 0.0)) + wave_tilt(1, above + vec2(reach, 0.0));
    vec2 south = wave_tilt(0, above + vec2(0.0, reach)) + wave_tilt(1, above + vec2(0.0, reach));
    float stretch = ((east.x - here.x) + (south.y - here.y)) / reach; // tilt is minus the slope
    float focus = 0.25 * min(depth, 4.0);
    float gathered = 1.0 / max(1.0 + focus * stretch, 0.28);
    float fade = smoothstep(0.0, 0.35, depth) * exp(-0.12 * depth);
    return mix(1.0, clamp(gathered, 0.45, 3.0), u_caustics * fade);
}

// Depth packed so that it survives half floats, linear filtering and a cleared target: 1 at the surface,
// 0 where there is no floor at all.
float pack_depth(float depth) { return 1.0 / (1.0 + max(depth, -0.5)); }
float unpack_depth(float packed_depth) { return 1.0 / clamp(packed_depth, 0.002, 2.0) - 1.0; }
