// Macros: FADE 1 leaves out pixels by u_fade; SWASH 1 has waves run up the beach; DRY, SUNKEN as in
// lib/light.glsl; default 0. SAND_NORMAL, EFFECT_MAP 0: the scene has no such maps; SAND 0: the effect map alone
// covers the patch; default 1.
#include "lib/clip_frag.glsl"
#include "lib/color.glsl"
#include "lib/fog.glsl"
#include "lib/hash.glsl"
#include "lib/light.glsl"
#include "lib/normal.glsl"
#include "lib/specular_antialiasing.glsl"

#ifndef FADE
#define FADE 0
#endif
#ifndef SAND_NORMAL
#define SAND_NORMAL 1
#endif
#ifndef EFFECT_MAP
#define EFFECT_MAP 1
#endif
#ifndef SAND
#define SAND 1
#endif
#ifndef SWASH
#define SWASH 0
#endif
#if SWASH && !DRY && !SUNKEN
#define WAVES_RUN_UP 1
#include "lib/swash.glsl"
uniform sampler2D u_reflection;
uniform float u_has_reflection; // 1 if there is one of this view
#else
#define WAVES_RUN_UP 0
#endif

uniform sampler2D u_sand_color;
uniform sampler2D u_sand_normal;
uniform sampler2D u_effect_color;
uniform sampler2D u_effect_normal;
uniform float u_sand_reference_m; // up to this distance the sand repeats at its baked scale
uniform vec4 u_sand_mix;          // low height m, high height m, specular, smoothness
uniform vec2 u_grain_offset_uv;   // displacement of the effect map by grains, UV
#if POINT_LIGHTS
flat in int v_light_set;
#endif
#if FADE
uniform vec2 u_fade;              // shown where the pixel's dither value is at least x and below y
#endif
uniform vec3 u_wet;               // height above the water up to which sand is wet, m; darkness; smoothness

in vec3 v_position;
in vec3 v_normal;
in vec4 v_tangent;
in vec2 v_uv_sand;
in vec2 v_uv_effect;
flat in vec3 v_zenith;
flat in vec3 v_sand_mean;

layout(location = 0) out vec4 fragment;

const float GRAIN_SLOPE = 1.1; // strength of the sand's own normals
const float LUMP_SLOPE = 0.42;
const float LUMPS = 0.19; // scale of the wide relief; not an integer, so that the two repeats never coincide

// Samples the sand at two scales, a factor of four apart, chosen by distance. Every pixel covers a similar
// number of grains, so that the pattern neither shimmers nor fades to one colour. The derivatives are
// arguments, because the scale jumps.
struct SandScale {
    float near;
    float far;
    float blend;
};

SandScale sand_scale(float distance_m) {
    float octave = 0.5 * log2(max(distance_m / u_sand_reference_m, 1.0));
    float whole = floor(octave);
    SandScale s;
    s.near = exp2(-2.0 * whole);
    s.far = 0.25 * s.near;
    s.blend = smoothstep(0.25, 0.95, octave - whole);
    return s;
}

vec4 sand_sample(sampler2D map, vec2 uv, SandScale s, vec2 dx, vec2 dy) {
    vec4 near = textureGrad(map, uv * s.near, dx * s.near, dy * s.near);
    if (s.blend <= 0.0) {
        return near;
    }
    vec4 far = textureGrad(map, uv * s.far, dx * s.far, dy * s.far);
    return mix(near, far, s.blend);
}

void main() {
    apply_clip();
    float height = v_position.y;
    float distance_m = distance(eye.xyz, v_position);
    vec2 dx = dFdx(v_uv_sand);
    vec2 dy = dFdy(v_uv_sand);
    // At grazing angles a pixel covers a long strip of sand, and mips for its length would blur the grains
    // away. The gradients are shortened towards the strip's mean size, at most to a third.
    float long_axis = max(dot(dx, dx), dot(dy, dy));
    float short_axis = min(dot(dx, dx), dot(dy, dy));
    float shorten = max(sqrt(sqrt(short_axis / max(long_axis, 1e-20))), 0.35);
    vec2 wide_dx = LUMPS * mix(shorten, 1.0, 0.6) * dx.yx;
    vec2 wide_dy = LUMPS * mix(shorten, 1.0, 0.6) * dy.yx;
    dx *= shorten;
    dy *= shorten;
    SandScale scale = sand_scale(distance_m);

    // Share of sand: 0 at the low height, 1 at the high height. Strength of grains on the effect map, from just
    // above the low height: they are finer than its texels.
#if EFFECT_MAP
    float sand_share = safe_smoothstep(u_sand_mix.x, u_sand_mix.y, height);
    float grain_full_m = mix(u_sand_mix.x, u_sand_mix.y, 0.08);
    float grain_strength = safe_smoothstep(u_sand_mix.x, grain_full_m, height);
#else
    const float sand_share = 1.0;
    const float grain_strength = 1.0;
#endif
    float near_eye = 1.0 - smoothstep(0.6 * u_sand_reference_m, 1.7 * u_sand_reference_m, distance_m);

    vec3 local_normal = vec3(0.0, 0.0, 1.0);
    vec2 grain_normal = vec2(0.0);
#if SAND && SAND_NORMAL
    if (grain_strength > 0.0) {
        grain_normal = sand_sample(u_sand_normal, v_uv_sand, scale, dx, dy).rg;
        local_normal = decode_normal(grain_normal, GRAIN_SLOPE * grain_strength);
        // Adds the same relief five times as wide, for trodden sand.
        vec2 wide = sand_sample(u_sand_normal, LUMPS * v_uv_sand.yx, scale, wide_dx, wide_dy).rg;
        local_normal = blend_normals(local_normal, decode_normal(wide, LUMP_SLOPE * grain_strength));
    }
#endif

    vec3 albedo = vec3(0.0);
    vec3 sand = vec3(0.0);
    float grain = 1.0;
#if SAND
    if (grain_strength > 0.0) {
        sand = sand_sample(u_sand_color, v_uv_sand, scale, dx, dy).rgb;
        float mean = luminance(v_sand_mean);
        grain = clamp(luminance(sand) / max(mean, 1e-3), 0.5, 1.6);
        // Close to the eye grains have more contrast.
        float contrast = 1.0 + 0.45 * near_eye * (grain - 1.0);
        albedo += sand_share * contrast * sand;
        grain *= contrast;
    }
#endif
#if EFFECT_MAP
    vec2 ex = dFdx(v_uv_effect);
    vec2 ey = dFdy(v_uv_effect);
    // Grains displace the effect map, which hides its texels.
    vec2 uv = v_uv_effect + grain_normal * (grain_strength * near_eye * u_grain_offset_uv);
    if (sand_share < 1.0) {
        vec3 effect = textureGrad(u_effect_color, uv, ex, ey).rgb;
        // Where the effect map is magnified, an unsharp mask sharpens it.
        float texels = sqrt(max(dot(ex, ex), dot(ey, ey))) * float(textureSize(u_effect_color, 0).x);
        float magnified = 1.0 - smoothstep(0.15, 0.6, texels);
        if (magnified > 0.0) {
            vec3 blurred = textureLod(u_effect_color, uv, 1.7).rgb;
            effect = clamp(effect + 1.4 * magnified * (effect - blurred), 0.5 * effect, vec3(1.0));
        }
        albedo += (1.0 - sand_share) * effect * mix(1.0, grain, grain_strength);
    }
    local_normal = blend_normals(decode_normal(textureGrad(u_effect_normal, uv, ex, ey).rg, 1.0), local_normal);
#endif
    // Broad, faint changes of tone, which hide the repeating pattern.
    vec2 world = v_position.xz + anchor.xz;
    float tone = value_noise(world * 0.11) + 0.5 * value_noise(world * 0.37 + 19.0);
    albedo *= 0.93 + 0.09 * tone;

#if SUNKEN
    // Under water there is no film on the sand: it is neither darker nor smoother there.
    const float wet = 1.0;
    const float film = 0.0;
    const float wet_smoothness = 0.0; // reflects nothing
#else
    // Wet sand is darker and glossier: J. Lekner, M. Dorf, "Why some things are darker when wet", Applied
    // Optics 27(7), 1988.
    float above = height - water.w + 0.25 * u_wet.x * (tone - 0.75);
    float wet = 1.0 - safe_smoothstep(0.35 * u_wet.x, u_wet.x, above);
    // The film ends a hand's breadth under water, where all around the grains is water.
    float ashore = 1.0 - smoothstep(0.0, 0.15, water.w - height);
    float darkening = u_wet.y * wet * ashore;
    albedo *= 1.0 - darkening * vec3(0.92, 1.0, 1.08);

    // Where the last wave ran, a film of water levels the grains and mirrors the sky.
    float film = (1.0 - safe_smoothstep(0.15 * u_wet.x, 0.6 * u_wet.x, above)) * ashore;
#if WAVES_RUN_UP
    float above_water = height - water.w;
    float pixel_m = sqrt(max(dot(dFdx(v_position), dFdx(v_position)), dot(dFdy(v_position), dFdy(v_position))));
    float height_per_pixel = fwidth(height);
    Swash swash = Swash(-1.0, 0.0, 0.0);
    // A loop, because software rasterisers leave one out where no pixel needs it, but not a branch.
    int reached = above_water < 1.2 * u_swash.x && above_water > -0.4 ? 1 : 0;
    for (int i = 0; i < reached; ++i) {
        swash = swash_at(world, above_water, height_per_pixel, pixel_m);
    }
    float sheet = safe_smoothstep(0.0, 0.12 * u_swash.x, swash.sheet) * ashore;
    film = max(0.7 * film, swash.film * ashore);
    albedo *= 1.0 - 0.22 * swash.film * ashore;
    albedo = mix(albedo, vec3(0.85), swash.foam);
    film *= 1.0 - swash.foam;
    wet *= 1.0 - swash.foam;
#endif
    float wet_smoothness = 1.0 - (1.0 - u_wet.z) * (1.0 - 0.55 * film);
#endif
    local_normal = safe_normalize(mix(local_normal, vec3(0.0, 0.0, 1.0), 0.9 * film), vec3(0.0, 0.0, 1.0));

    vec3 geometric = safe_normalize(v_normal, vec3(0.0, 1.0, 0.0));
    vec3 world_normal = tangent_to_world(local_normal, v_normal, v_tangent);
    Surface s = matte_surface(v_position, world_normal, geometric, albedo, v_zenith);
    s.reflector = dielectric_reflector(mix(0.04 * u_sand_mix.z, 0.02, wet));
    s.alpha = filtered_alpha(s.normal, alpha_of_smoothness(mix(u_sand_mix.w, wet_smoothness, wet)));
#if POINT_LIGHTS
    light_set = v_light_set;
#endif
    vec3 color = shade(s);
#if WAVES_RUN_UP
    // The sheet mirrors what the sea mirrors beside it.
    vec3 v = safe_normalize(eye.xyz - v_position, vec3(0.0, 1.0, 0.0));
    float mirror = u_has_reflection * max(sheet, 0.6 * swash.film * ashore) * (1.0 - swash.foam);
    vec2 ripple = wave_tilt(0, v_position.xz) + wave_tilt(1, v_position.xz);
    vec2 screen = gl_FragCoord.xy * viewport.zw + vec2(0.0, 0.06 * ripple.y);
    vec3 mirrored = texture(u_reflection, clamp(screen, viewport.zw, 1.0 - viewport.zw)).rgb;
    color = mix(color, mirrored, mirror * fresnel_schlick(0.02, max(v.y, 0.0)));
#endif

    if (u_refracting > 0.5) {
        // The floor fades out towards the terrain's border, so that the border is not visible.
        vec2 border = min(v_uv_effect, 1.0 - v_uv_effect);
        float edge_fade = smoothstep(0.0, 0.08, min(border.x, border.y));
        fragment = vec4(color, pack_depth(water.w - height) * edge_fade);
    } else {
        fragment = vec4(apply_haze(color, v_position), 1.0);
    }
#if FADE
    // Last, because the derivatives above need all pixels. Other patches never discard, so that the depth test
    // comes first.
    float dither = gradient_noise(gl_FragCoord.xy);
    if (dither < u_fade.x || dither >= u_fade.y) {
        discard;
    }
#endif
}
