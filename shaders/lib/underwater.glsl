// Sunlight below the water's surface.
#include "lib/frame.glsl"
#include "lib/waves.glsl"

uniform float u_caustics;     // strength; 0: no water
uniform vec3 u_sun_refracted; // unit, towards the sun, refracted by the surface

// Transmittance of sunlight to a depth in metres, along the refracted ray.
vec3 sun_through_water(float depth) {
    return exp(-min(water.rgb * max(depth, 0.0) / max(u_sun_refracted.y, 0.2), vec3(60.0)));
}

// Caustics: brightness above a point by the focusing of waves. A slope s bends a ray sideways by about depth
// * (1 - 1/1.33) * s. Brightness is the inverse of the area of a small bundle of rays, the determinant of its
// Jacobian: D. Guardado, D. Sanchez-Crespo, "Rendering Water Caustics", GPU Gems, 2004, with one-sided
// differences. Where rays cross, the sun's width keeps the brightness finite,
// without a flat top.
float caustics(vec3 position, float depth) {
    vec2 above = position.xz + u_sun_refracted.xz * (depth / max(u_sun_refracted.y, 0.2));
    const float step_m = 0.16;
    vec2 here = wave_tilt(0, above) + wave_tilt(1, above);
    vec2 east = wave_tilt(0, above + vec2(step_m, 0.0)) + wave_tilt(1, above + vec2(step_m, 0.0)) - here;
    vec2 south = wave_tilt(0, above + vec2(0.0, step_m)) + wave_tilt(1, above + vec2(0.0, step_m)) - here;
    float focus = 0.25 * clamp(depth, 0.0, 1.0) / step_m; // the tilt is minus the slope
    float area = (1.0 + focus * east.x) * (1.0 + focus * south.y) - focus * focus * east.y * south.x;
    float gain = sqrt(1.08 / (area * area + 0.08));
    float fade = smoothstep(0.0, 0.35, depth) * exp(-0.12 * depth);
    return mix(1.0, gain, u_caustics * fade);
}

// Packs a depth in metres for half floats and linear filtering: 1 at the surface, 0 (the cleared value) where
// there is no floor.
float pack_depth(float depth) { return 1.0 / (1.0 + max(depth, -0.5)); }
float unpack_depth(float packed_depth) { return 1.0 / clamp(packed_depth, 0.002, 2.0) - 1.0; }
