// Shadow of the sun, L. Williams, "Casting Curved Shadows on Curved Surfaces", SIGGRAPH 1978, filtered by
// percentage closer filtering (W. Reeves, D. Salesin, R. Cook, SIGGRAPH 1987): the hardware compares and
// blends 2 x 2 texels a tap.
#include "lib/frame.glsl"

// How the map is looked up: 0 one tap, 1 a disc near the eye and four taps beyond, 2 as soft as the sun is wide,
// 3 the one texel below the point, for pictures that average many places of the sun.
#ifndef SHADOW_FILTER
#define SHADOW_FILTER 1
#endif

uniform sampler2DShadow u_shadow_map;
uniform float u_shadow_texel;   // 1 / size of the map
uniform float u_shadow_texel_m; // metres that one texel covers
uniform float u_shadow_radius;  // texels, of the soft edge near the camera
uniform float u_shadow_blur_m;  // metres from the camera within which edges are soft

// 12 points of Vogel's spiral, H. Vogel, "A better way to construct the sunflower head", 1979: fixed, so
// that nothing crawls as the camera moves; together with bilinear taps they leave no visible steps.
const vec2 SHADOW_DISC[12] = vec2[12](
    vec2(0.2041, 0.0000), vec2(-0.2607, 0.2388), vec2(0.0399, -0.4547), vec2(0.3286, 0.4286),
    vec2(-0.6031, -0.1067), vec2(0.5710, -0.3633), vec2(-0.1905, 0.7109), vec2(-0.3639, -0.7015),
    vec2(0.7897, 0.2889), vec2(-0.8228, 0.3403), vec2(0.3975, -0.8466), vec2(0.3057, 0.9303));

#if SHADOW_FILTER >= 2
uniform sampler2D u_shadow_depth; // the same map, read without comparing
uniform float u_shadow_range_m;   // metres from its depth 0 to its depth 1
#endif

#if SHADOW_FILTER == 2
// Point i of Vogel's spiral of `count`, in the disc of radius 1.
vec2 spiral(int i, float count) {
    float angle = 2.39996323 * float(i);
    return sqrt((float(i) + 0.5) / count) * vec2(cos(angle), sin(angle));
}

const float HIGHEST_M = 20.0; // casters are looked for that stand so far above what they shade

// The mean height of what stands between a point and the sun says how wide the edge is: R. Fernando,
// "Percentage-Closer Soft Shadows", SIGGRAPH 2005 sketches; here with parallel light, so that the edge grows by the
// sun's angular radius.
float soft_visibility(vec3 p) {
    float uv_of_m = u_shadow_texel / u_shadow_texel_m;
    float slope = tan(clamp(sun_direction.w, 1e-4, 0.5));
    float search = max(HIGHEST_M * slope * uv_of_m, u_shadow_texel);
    float depths = 0.0;
    float found = 0.0;
    for (int i = 0; i < 16; ++i) {
        float depth = textureLod(u_shadow_depth, p.xy + spiral(i, 16.0) * search, 0.0).r;
        float before = step(depth, p.z);
        depths += before * depth;
        found += before;
    }
    if (found < 0.5) {
        return 1.0;
    }
    float gap_m = max(p.z - depths / found, 0.0) * u_shadow_range_m;
    float radius = clamp(gap_m * slope * uv_of_m, 0.7 * u_shadow_texel, search);
    float lit = 0.0;
    for (int i = 0; i < 32; ++i) {
        lit += textureLod(u_shadow_map, vec3(p.xy + spiral(i, 32.0) * radius, p.z), 0.0);
    }
    return lit * (1.0 / 32.0);
}
#endif

// Share of the sun's disc seen from a world position, [0,1]. Outside the map, and behind or before the
// light's range, everything is lit.
float sun_visibility(vec3 position, vec3 normal, float eye_distance_m) {
    if (sun_radiance.w < 0.5) {
        return 1.0;
    }
    // The point is moved off its surface, more where light grazes it: D. Holbert, "Saying Goodbye to
    // Shadow Acne", GDC 2011.
    float n_l = clamp(dot(normal, sun_direction.xyz), 0.0, 1.0);
    vec3 lifted = position + normal * (u_shadow_texel_m * (0.6 + 1.8 * sqrt(1.0 - n_l * n_l)));
    vec4 projected = shadow_from_world * vec4(lifted, 1.0);
    vec3 p = projected.xyz;
    if (projected.w <= 0.0 || any(lessThan(p, vec3(0.0))) || any(greaterThan(p, vec3(1.0)))) {
        return 1.0;
    }
    vec2 border = min(p.xy, 1.0 - p.xy);
    float inside = smoothstep(0.0, 0.03, min(border.x, border.y)); // the map's edge is not seen
#if SHADOW_FILTER == 0
    float lit = textureLod(u_shadow_map, p, 0.0);
#elif SHADOW_FILTER == 2
    float lit = soft_visibility(p);
#elif SHADOW_FILTER == 3
    float lit = step(p.z, textureLod(u_shadow_depth, p.xy, 0.0).r);
#else
    float lit;
    if (eye_distance_m < u_shadow_blur_m) {
        float near = 1.0 - smoothstep(0.6 * u_shadow_blur_m, u_shadow_blur_m, eye_distance_m);
        float radius = u_shadow_texel * mix(0.7, u_shadow_radius, near);
        // The disc's rim first: where it is all lit or all dark, so is the rest. Y. Uralsky, "Efficient
        // Soft-Edged Shadows Using Pixel Shader Branching", GPU Gems 2, 2005.
        lit = 0.0;
        for (int i = 8; i < 12; ++i) {
            lit += texture(u_shadow_map, vec3(p.xy + SHADOW_DISC[i] * radius, p.z));
        }
        if (lit > 0.0 && lit < 4.0) {
            for (int i = 0; i < 8; ++i) {
                lit += texture(u_shadow_map, vec3(p.xy + SHADOW_DISC[i] * radius, p.z));
            }
            lit *= 1.0 / 12.0;
        } else {
            lit *= 0.25;
        }
    } else {
        float step_uv = 0.75 * u_shadow_texel;
        lit = 0.25 * (texture(u_shadow_map, p + vec3(step_uv, 0.25 * step_uv, 0.0)) +
                      texture(u_shadow_map, p + vec3(-0.25 * step_uv, step_uv, 0.0)) +
                      texture(u_shadow_map, p + vec3(-step_uv, -0.25 * step_uv, 0.0)) +
                      texture(u_shadow_map, p + vec3(0.25 * step_uv, -step_uv, 0.0)));
    }
#endif
    return mix(1.0, lit, inside);
}
