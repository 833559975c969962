// Shadow mapping: L. Williams, "Casting Curved Shadows on Curved Surfaces", SIGGRAPH 1978. Percentage-closer
// filtering: W. Reeves, D. Salesin, R. Cook, SIGGRAPH 1987. The hardware compares and blends 2 x 2 texels per
// tap.
#include "lib/frame.glsl"

// 0: one tap. 1: a disc of 12 taps near the eye, 4 taps beyond. 2: penumbra by blocker distance (PCSS). 3:
// one texel without filtering, for --reference, which averages many points of the sun's disc.
#ifndef SHADOW_FILTER
#define SHADOW_FILTER 1
#endif

uniform sampler2DShadow u_shadow_map;
uniform float u_shadow_texel;   // 1 / size of the map
uniform float u_shadow_texel_m; // metres per texel
uniform float u_shadow_radius;  // radius of the soft edge near the camera, texels
uniform float u_shadow_blur_m;  // edges are soft up to this distance from the camera, metres

// 12 points of Vogel's spiral: H. Vogel, "A better way to construct the sunflower head", 1979. The points are
// fixed, so that shadows do not crawl when the camera moves. Bilinear taps hide the steps between them.
const vec2 SHADOW_DISC[12] = vec2[12](
    vec2(0.2041, 0.0000), vec2(-0.2607, 0.2388), vec2(0.0399, -0.4547), vec2(0.3286, 0.4286),
    vec2(-0.6031, -0.1067), vec2(0.5710, -0.3633), vec2(-0.1905, 0.7109), vec2(-0.3639, -0.7015),
    vec2(0.7897, 0.2889), vec2(-0.8228, 0.3403), vec2(0.3975, -0.8466), vec2(0.3057, 0.9303));

#if SHADOW_FILTER >= 2
uniform sampler2D u_shadow_depth; // the same map, read without comparison
uniform float u_shadow_range_m;   // metres from depth 0 to depth 1 of the map
#endif

#if SHADOW_FILTER == 2
// Point i of Vogel's spiral with `count` points, in the disc of radius 1.
vec2 spiral(int i, float count) {
    float angle = 2.39996323 * float(i);
    return sqrt((float(i) + 0.5) / count) * vec2(cos(angle), sin(angle));
}

const float MAX_CASTER_HEIGHT_M = 20.0; // height above the surface up to which blockers are searched

// The mean depth of the blockers gives the width of the penumbra: R. Fernando, "Percentage-Closer Soft
// Shadows", SIGGRAPH 2005 sketches. The light is parallel here, so that the penumbra grows with the sun's
// angular radius.
float soft_visibility(vec3 p) {
    float uv_of_m = u_shadow_texel / u_shadow_texel_m;
    float slope = tan(clamp(sun_direction.w, 1e-4, 0.5));
    float search = max(MAX_CASTER_HEIGHT_M * slope * uv_of_m, u_shadow_texel);
    float depths = 0.0;
    float blockers = 0.0;
    for (int i = 0; i < 16; ++i) {
        float depth = textureLod(u_shadow_depth, p.xy + spiral(i, 16.0) * search, 0.0).r;
        float is_blocker = step(depth, p.z);
        depths += is_blocker * depth;
        blockers += is_blocker;
    }
    if (blockers < 0.5) {
        return 1.0;
    }
    float blocker_distance_m = max(p.z - depths / blockers, 0.0) * u_shadow_range_m;
    float radius = clamp(blocker_distance_m * slope * uv_of_m, 0.7 * u_shadow_texel, search);
    float lit = 0.0;
    for (int i = 0; i < 32; ++i) {
        lit += textureLod(u_shadow_map, vec3(p.xy + spiral(i, 32.0) * radius, p.z), 0.0);
    }
    return lit * (1.0 / 32.0);
}
#endif

// Visible share of the sun's disc, [0,1]. Positions outside the map or the light's depth range are lit.
float sun_visibility(vec3 position, vec3 normal, float eye_distance_m) {
    if (sun_radiance.w < 0.5) {
        return 1.0;
    }
    // Moves the position along the normal, more at grazing light: D. Holbert, "Saying Goodbye to Shadow
    // Acne", GDC 2011.
    float n_l = clamp(dot(normal, sun_direction.xyz), 0.0, 1.0);
    vec3 offset_position = position + normal * (u_shadow_texel_m * (0.6 + 1.8 * sqrt(1.0 - n_l * n_l)));
    vec4 projected = shadow_from_world * vec4(offset_position, 1.0);
    vec3 p = projected.xyz;
    if (projected.w <= 0.0 || any(lessThan(p, vec3(0.0))) || any(greaterThan(p, vec3(1.0)))) {
        return 1.0;
    }
    vec2 border = min(p.xy, 1.0 - p.xy);
    float inside = smoothstep(0.0, 0.03, min(border.x, border.y)); // fades out at the map's border
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
        // The rim of the disc first. If it is all lit or all dark, so is the rest: Y. Uralsky, "Efficient
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
