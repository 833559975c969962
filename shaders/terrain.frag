#include "lib/clip_frag.glsl"
#include "lib/color.glsl"
#include "lib/fog.glsl"
#include "lib/hash.glsl"
#include "lib/light.glsl"
#include "lib/normal.glsl"

uniform sampler2D u_sand_color;
uniform sampler2D u_sand_normal;
uniform sampler2D u_effect_color;
uniform sampler2D u_effect_normal;
uniform float u_has_sand_normal;
uniform float u_has_effect;
uniform float u_sand_reference_m; // distance up to which the sand repeats as it was baked
uniform vec4 u_mix;               // low m, high m, specular, smoothness
uniform vec2 u_edge;              // how far grains move what lies on the ground: UV of the effect map
uniform vec3 u_wet;               // up to this many metres above the water, darkness, smoothness

in vec3 v_position;
in vec3 v_normal;
in vec4 v_tangent;
in vec2 v_uv_sand;
in vec2 v_uv_effect;

layout(location = 0) out vec4 fragment;

const float GRAIN_SLOPE = 1.1; // factors on the sand's own relief
const float LUMP_SLOPE = 0.42;
const float LUMPS = 0.19;      // scale of the wide relief: no whole number, so that the two never agree

// The sand at two scales, a factor of four apart, that suit the distance: each pixel sees about as many
// grains near and far, so that the pattern neither shimmers nor melts into one colour. uv: its derivatives
// come from outside, for the scale itself jumps.
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

vec4 sand_sample(sampler2D map, SandScale s, vec2 dx, vec2 dy) {
    vec4 near = textureGrad(map, v_uv_sand * s.near, dx * s.near, dy * s.near);
    if (s.blend <= 0.0) {
        return near;
    }
    vec4 far = textureGrad(map, v_uv_sand * s.far, dx * s.far, dy * s.far);
    return mix(near, far, s.blend);
}

void main() {
    apply_clip();
    float height = v_position.y;
    float distance_m = distance(eye.xyz, v_position);
    vec2 dx = dFdx(v_uv_sand);
    vec2 dy = dFdy(v_uv_sand);
    // Seen flat, a pixel covers a long strip of sand. Mips chosen by its length melt the grains away, so the
    // gradients are shortened towards the strip's middle size, never below a third.
    float long_axis = max(dot(dx, dx), dot(dy, dy));
    float short_axis = min(dot(dx, dx), dot(dy, dy));
    float shorten = max(sqrt(sqrt(short_axis / max(long_axis, 1e-20))), 0.35);
    vec2 wide_dx = LUMPS * mix(shorten, 1.0, 0.6) * dx.yx;
    vec2 wide_dy = LUMPS * mix(shorten, 1.0, 0.6) * dy.yx;
    dx *= shorten;
    dy *= shorten;
    SandScale scale = sand_scale(distance_m);

    // How much sand: none up to mix_low, all from mix_high.
    float sand_share = u_has_effect > 0.5 ? safe_smoothstep(u_mix.x, u_mix.y, height) : 1.0;
    // What the effect map borrows of it, from just above mix_low: grains, which are finer than its own texels.
    float borrowed = u_has_effect > 0.5 ? safe_smoothstep(u_mix.x, mix(u_mix.x, u_mix.y, 0.08), height) : 1.0;
    float close = 1.0 - smoothstep(0.6 * u_sand_reference_m, 1.7 * u_sand_reference_m, distance_m);

    vec3 relief = vec3(0.0, 0.0, 1.0);
    vec2 grains = vec2(0.0);
    if (u_has_sand_normal > 0.5 && borrowed > 0.0) {
        grains = sand_sample(u_sand_normal, scale, dx, dy).rg;
        relief = decode_normal(grains, GRAIN_SLOPE * borrowed);
        if (close > 0.0) {
            // Trodden sand is uneven by the hand as well: the same relief again, five times as wide.
            vec2 wide = textureGrad(u_sand_normal, LUMPS * v_uv_sand.yx, wide_dx, wide_dy).rg;
            relief = blend_normals(relief, decode_normal(wide, LUMP_SLOPE * borrowed * close));
        }
    }

    vec3 albedo = vec3(0.0);
    vec3 sand = vec3(0.0);
    float grain = 1.0;
    if (borrowed > 0.0) {
        sand = sand_sample(u_sand_color, scale, dx, dy).rgb;
        float mean = luminance(textureLod(u_sand_color, v_uv_sand, 16.0).rgb);
        grain = clamp(luminance(sand) / max(mean, 1e-3), 0.5, 1.6);
        // Close by, single grains stand apart from one another.
        float apart = 1.0 + 0.45 * close * (grain - 1.0);
        albedo += sand_share * apart * sand;
        grain *= apart;
    }
    if (u_has_effect > 0.5) {
        vec2 ex = dFdx(v_uv_effect);
        vec2 ey = dFdy(v_uv_effect);
        // The grains break up the edges of what is drawn on the ground, so that its texels do not show.
        vec2 uv = v_uv_effect + grains * (borrowed * close * u_edge);
        if (sand_share < 1.0) {
            vec3 effect = textureGrad(u_effect_color, uv, ex, ey).rgb;
            // Magnified, its shapes are sharpened by what distinguishes them from their surroundings.
            float texels = sqrt(max(dot(ex, ex), dot(ey, ey))) * float(textureSize(u_effect_color, 0).x);
            float magnified = 1.0 - smoothstep(0.15, 0.6, texels);
            if (magnified > 0.0) {
                vec3 around = textureLod(u_effect_color, uv, 1.7).rgb;
                effect = clamp(effect + 1.4 * magnified * (effect - around), 0.5 * effect, vec3(1.0));
            }
            albedo += (1.0 - sand_share) * effect * mix(1.0, grain, borrowed);
        }
        relief = blend_normals(decode_normal(textureGrad(u_effect_normal, uv, ex, ey).rg, 1.0), relief);
    }
    // Broad, faint changes of tone that the repeating pattern cannot have.
    vec2 world = v_position.xz + anchor.xz;
    float tone = value_noise(world * 0.11) + 0.5 * value_noise(world * 0.37 + 19.0);
    albedo *= 0.93 + 0.09 * tone;

    // Where the sea reaches, sand is darker and glossier: J. Lekner, M. Dorf, "Why some things are darker
    // when wet", Applied Optics 27(7), 1988.
    float above = height - water.w + 0.25 * u_wet.x * (tone - 0.75);
    float wet = 1.0 - safe_smoothstep(0.35 * u_wet.x, u_wet.x, above);
    // Under water there is no film to hold the light back: the water itself colours the floor.
    float dark = u_wet.y * wet * (1.0 - smoothstep(0.0, 0.15, water.w - height));
    albedo *= 1.0 - dark * vec3(0.92, 1.0, 1.08);

    vec3 geometric = safe_normalize(v_normal, vec3(0.0, 1.0, 0.0));
    vec3 shaded = tangent_to_world(relief, v_normal, v_tangent);
    Surface s = matte_surface(v_position, shaded, geometric, albedo);
    s.f0 = mix(0.04 * u_mix.z, 0.02, wet);
    s.alpha = filtered_alpha(s.normal, alpha_of_smoothness(mix(u_mix.w, u_wet.z, wet)));
    vec3 color = shade(s);

    if (u_refracting > 0.5) {
        // Towards its own edge the floor is lost in the deep, so that the terrain's border is never seen.
        vec2 border = min(v_uv_effect, 1.0 - v_uv_effect);
        float kept = smoothstep(0.0, 0.08, min(border.x, border.y));
        fragment = vec4(color, pack_depth(water.w - height) * kept);
    } else {
        fragment = vec4(apply_haze(color, v_position), 1.0);
    }
}
