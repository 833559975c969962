// Shadow mapping: L. Williams, "Casting Curved Shadows on Curved Surfaces", SIGGRAPH 1978. Percentage-closer
// filtering: W. Reeves, D. Salesin, R. Cook, SIGGRAPH 1987. The hardware compares and blends 2 x 2 texels per
// tap. Cascades: W. Engel, "Cascaded Shadow Maps", ShaderX5, 2006; player/scene/cascades.hpp places them.
#include "lib/frame.glsl"

// 0: one tap. 1: a disc of 12 taps near the eye, 4 taps beyond. 2: penumbra by blocker distance (PCSS). 3:
// one texel without filtering, for --reference, which averages many points of the sun's disc.
#ifndef SHADOW_FILTER
#define SHADOW_FILTER 1
#endif
#ifndef SHADOW_CASCADES
#define SHADOW_CASCADES 1
#endif

uniform sampler2DArrayShadow u_shadow_map; // one layer per cascade: 0 the whole square, then finer ones
// Of each cascade: scale and offset from coordinates in the whole square; metres per texel.
uniform vec4 u_shadow_cascades[SHADOW_CASCADES];
uniform float u_shadow_texel;      // 1 / size of a layer
uniform float u_shadow_penumbra_m; // radius of the soft edge near the camera
uniform float u_shadow_blur_m;     // edges are soft up to this distance from the camera, metres

// 12 points of Vogel's spiral: H. Vogel, "A better way to construct the sunflower head", 1979. The points are
// fixed, so that shadows do not crawl when the camera moves. Bilinear taps hide the steps between them.
const vec2 SHADOW_DISC[12] = vec2[12](
    vec2(0.2041, 0.0000), vec2(-0.2607, 0.2388), vec2(0.0399, -0.4547), vec2(0.3286, 0.4286),
    vec2(-0.6031, -0.1067), vec2(0.5710, -0.3633), vec2(-0.1905, 0.7109), vec2(-0.3639, -0.7015),
    vec2(0.7897, 0.2889), vec2(-0.8228, 0.3403), vec2(0.3975, -0.8466), vec2(0.3057, 0.9303));
const float WIDEST_DISC = 4.0; // texels: wider, the steps between the taps would show

#if SHADOW_FILTER >= 2
uniform sampler2DArray u_shadow_depth; // the same map, read without comparison
uniform float u_shadow_range_m;        // metres from depth 0 to depth 1 of the map
#endif

// A surface point, and where the map holds it: in a cascade, and in the next coarser one, which a share of the
// taps reads near the border. So cascades blend at the cost of one.
struct ShadowPoint {
    vec3 fine, coarse;               // in coordinates of the cascades, [0,1]^3, moved off the surface
    float fine_layer, coarse_layer;
    float share;                     // of the taps that read the finer one
    vec3 fine_axis, coarse_axis;     // the pixel's long axis on the surface, with the depth along it
    float texel_m, coarse_texel_m;   // metres per texel
    float pixel_m;                   // width of the pixel
    float eye_distance_m;
};

// Spreads i evenly over [0,1), unlike its place in the disc.
float spread(int i) { return fract(float(i) * 0.61803399 + 0.25); }

// Lit or not, at an offset of some texels of the finer cascade; between texels a share.
float tap(ShadowPoint point, int i, vec2 texels) {
    float across = spread(i);
    bool fine = fract(across * 7.0) < point.share;
    vec3 p = fine ? point.fine : point.coarse;
    p += (across - 0.5) * (fine ? point.fine_axis : point.coarse_axis);
    p.xy += texels * (u_shadow_texel * (fine ? 1.0 : point.texel_m / point.coarse_texel_m));
    return texture(u_shadow_map, vec4(p.xy, fine ? point.fine_layer : point.coarse_layer, p.z));
}

// at: coordinates in the whole square; across: the offset along the normal for a texel of 1 m.
vec3 in_cascade(vec4 fit, vec3 at, vec3 across) {
    vec3 p = at + across * fit.w;
    return vec3(p.xy * fit.x + fit.yz, p.z);
}

// Distance from the nearest border of a cascade, a share of its side; negative outside.
float inside_border(vec2 p) {
    vec2 border = min(p, 1.0 - p);
    return min(border.x, border.y);
}

// The pixel's long axis in a cascade, no longer than the taps can fill.
vec3 long_axis(vec4 fit, vec3 footprint) {
    vec3 axis = vec3(footprint.xy * fit.x, footprint.z);
    float longest = 3.0 * WIDEST_DISC * u_shadow_texel;
    return axis * min(1.0, longest * inversesqrt(max(dot(axis.xy, axis.xy), 1e-20)));
}

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
float filtered(ShadowPoint point) {
    vec3 p = point.fine;
    float slope = tan(clamp(sun_direction.w, 1e-4, 0.5));
    float search = max(MAX_CASTER_HEIGHT_M * slope / point.texel_m, 1.0);
    float depths = 0.0;
    float blockers = 0.0;
    for (int i = 0; i < 16; ++i) {
        vec2 place = p.xy + spiral(i, 16.0) * search * u_shadow_texel;
        float depth = textureLod(u_shadow_depth, vec3(place, point.fine_layer), 0.0).r;
        float is_blocker = step(depth, p.z);
        depths += is_blocker * depth;
        blockers += is_blocker;
    }
    if (blockers < 0.5) {
        return 1.0;
    }
    float blocker_distance_m = max(p.z - depths / blockers, 0.0) * u_shadow_range_m;
    float radius = clamp(blocker_distance_m * slope / point.texel_m, 0.7, search);
    float lit = 0.0;
    for (int i = 0; i < 32; ++i) {
        lit += tap(point, i, spiral(i, 32.0) * radius);
    }
    return lit * (1.0 / 32.0);
}
#elif SHADOW_FILTER == 1
// Edges are as wide as the penumbra near the eye, and nowhere narrower than the pixel, which would flicker.
float filtered(ShadowPoint point) {
    float near = 0.0;
    if (point.eye_distance_m < u_shadow_blur_m) {
        near = 1.0 - smoothstep(0.6 * u_shadow_blur_m, u_shadow_blur_m, point.eye_distance_m);
    }
    float width = max(u_shadow_penumbra_m * near, 0.5 * point.pixel_m);
    float radius = clamp(width / point.texel_m, 0.8, WIDEST_DISC);
    // Beyond that distance the rim alone.
    int first = near > 0.0 ? 0 : 8;
    float lit = 0.0;
    for (int i = first; i < 12; ++i) {
        lit += tap(point, i, SHADOW_DISC[i] * radius);
    }
    return lit / float(12 - first);
}
#elif SHADOW_FILTER == 0
float filtered(ShadowPoint point) {
    return texture(u_shadow_map, vec4(point.fine.xy, point.fine_layer, point.fine.z));
}
#else
float filtered(ShadowPoint point) {
    return step(point.fine.z, textureLod(u_shadow_depth, vec3(point.fine.xy, point.fine_layer), 0.0).r);
}
#endif

// Visible share of the sun's disc, [0,1]. Positions outside the map or the light's depth range are lit.
float sun_visibility(vec3 position, vec3 normal, float eye_distance_m) {
    if (sun_radiance.w < 0.5) {
        return 1.0;
    }
    vec4 projected = shadow_from_world * vec4(position, 1.0);
    mat3 to_map = mat3(shadow_from_world);
    // Moves the position along the normal, more at grazing light: D. Holbert, "Saying Goodbye to Shadow
    // Acne", GDC 2011.
    float n_l = clamp(dot(normal, sun_direction.xyz), 0.0, 1.0);
    vec3 across = to_map * normal * (0.6 + 1.8 * sqrt(1.0 - n_l * n_l));
    vec4 fine = u_shadow_cascades[0];
    vec4 coarse = fine;
    ShadowPoint point;
    point.fine = in_cascade(fine, projected.xyz, across);
    float inside = inside_border(point.fine.xy);
    if (projected.w <= 0.0 || inside < 0.0 || point.fine.z < 0.0 || point.fine.z > 1.0) {
        return 1.0;
    }
    float lit_outside = smoothstep(0.0, 0.03, inside);
    point.coarse = point.fine;
    point.fine_layer = 0.0;
    point.coarse_layer = 0.0;
    point.share = 1.0;
    point.eye_distance_m = eye_distance_m;
    point.pixel_m = eye_distance_m / max(lens.z, 1e-3);
#if SHADOW_CASCADES > 1
    // The finest cascade that contains the point, but none with texels much smaller than the pixel: taps would
    // miss what lies between them.
    float contained = 1.0;
    for (int i = 1; i < SHADOW_CASCADES; ++i) {
        vec4 fit = u_shadow_cascades[i];
        vec3 p = in_cascade(fit, projected.xyz, across);
        contained = min(contained, smoothstep(0.03, 0.1, inside_border(p.xy)));
        float share = contained;
#if SHADOW_FILTER < 3
        share *= 1.0 - smoothstep(1.5, 3.0, point.pixel_m / fit.w);
#endif
        if (share > 0.0) {
            coarse = fine;
            fine = fit;
            point.coarse = point.fine;
            point.fine = p;
            point.coarse_layer = point.fine_layer;
            point.fine_layer = float(i);
            point.share = share;
        }
    }
#endif
    point.texel_m = fine.w;
    point.coarse_texel_m = coarse.w;
    vec3 v = (eye.xyz - position) / max(eye_distance_m, 1e-3);
    float n_v = dot(normal, v);
    vec3 footprint = to_map * (v - normal * n_v) * (point.pixel_m / max(abs(n_v), 0.05));
    point.fine_axis = long_axis(fine, footprint);
    point.coarse_axis = long_axis(coarse, footprint);
    return mix(1.0, filtered(point), lit_outside);
}
