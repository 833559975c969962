// Shadow of the sun, L. Williams, "Casting Curved Shadows on Curved Surfaces", SIGGRAPH 1978, filtered by
// percentage closer filtering (W. Reeves, D. Salesin, R. Cook, SIGGRAPH 1987): the hardware compares and
// blends 2 x 2 texels a tap.
#include "lib/frame.glsl"

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
    return mix(1.0, lit, inside);
}
