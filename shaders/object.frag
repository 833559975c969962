// Macros: ALPHA_MODE 0 opaque, 1 holes where alpha is below the cutoff, 2 blended; ALPHA_TAPS 0 discards fragments below the
// cutoff, 1 or 4: alpha becomes coverage, by as many lookups; default 0. VERTEX_COLORS, SECOND_UV and VERTEX_LIT as in object.vert. The model of materials is glTF's: The Khronos Group, "glTF 2.0 Specification", 2021,
// section 3.9 and appendix B.
#include "lib/clip_frag.glsl"
#include "lib/fog.glsl"
#include "lib/light.glsl"
#include "lib/material.glsl"
#include "lib/normal.glsl"
#include "lib/parallax.glsl"
#include "lib/specular_antialiasing.glsl"

#ifndef ALPHA_MODE
#define ALPHA_MODE 0
#endif
#ifndef ALPHA_TAPS
#define ALPHA_TAPS 0
#endif
#ifndef VERTEX_COLORS
#define VERTEX_COLORS 0
#endif
#ifndef SECOND_UV
#define SECOND_UV 0
#endif
#ifndef VERTEX_LIT
#define VERTEX_LIT 0
#endif

uniform sampler2D u_color;
uniform sampler2D u_normal;
uniform sampler2D u_height;
uniform sampler2D u_gloss;     // R specular intensity, G smoothness
uniform sampler2D u_occlusion; // R share of the light from all around, G metalness
uniform sampler2D u_emission;

#if VERTEX_LIT
in vec3 v_front;
in vec3 v_back;
in vec3 v_haze;
#else
in vec3 v_position;
in vec3 v_normal;
in vec4 v_tangent;
flat in vec3 v_zenith;
#if POINT_LIGHTS
flat in int v_light_set;
#endif
#endif
in vec2 v_uv;
#if SECOND_UV
uniform sampler2D u_second_normal;
uniform sampler2D u_second_gloss;
uniform sampler2D u_second_occlusion;
uniform sampler2D u_second_emission;
in vec2 v_second_uv;
#endif
#if VERTEX_COLORS
in vec4 v_color;
#endif

layout(location = 0) out vec4 fragment;

// With ray marching, neighbouring pixels may hit distant points of the relief. Gradients of the surface's UV
// avoid too coarse mips there.
#if PARALLAX_STEPS > 2
#define FETCH(map) textureGrad(map, uv, dFdx(v_uv), dFdy(v_uv))
#else
#define FETCH(map) texture(map, uv)
#endif

#ifndef TRANSLUCENT
#define TRANSLUCENT 1
#endif
#ifndef COLOR_MAP
#define COLOR_MAP 1
#endif
#ifndef NORMAL_MAP
#define NORMAL_MAP 1
#define GLOSS_MAP 1
#define OCCLUSION_MAP 1
#define EMISSION_MAP 1
#endif

#if ALPHA_MODE == 2
uniform float u_solid; // 1: draws what hides all behind it, into the depth buffer too; 0: the rest
const float SOLID = 254.5 / 255.0;
#endif

#if ALPHA_MODE == 1
// Sharpens alpha to an edge at any distance. edge: how much alpha changes from pixel to pixel. B. Golus, "Anti-aliased
// Alpha Test", 2017.
vec4 covered(vec4 alpha, float edge) {
    return clamp((alpha - material.alpha_cutoff) / edge + 0.5, 0.0, 1.0);
}
#endif

#if ALPHA_MODE == 1 && ALPHA_TAPS > 1
// The colour of the pixel, the mean of lookups at four places in mips two levels finer, and the alpha of each. Where holes
// are as small as pixels, a lookup for the whole pixel merges them: what is half covered becomes a plate that steps. B.
// Golus, "Sharper Mipmapping using Shader Based Supersampling", 2018.
vec4 tapped_color(vec2 uv, out vec4 alphas) {
    const vec2 places[4] = vec2[4](vec2(-0.125, -0.375), vec2(0.375, -0.125), vec2(0.125, 0.375), vec2(-0.375, 0.125));
    vec2 x = dFdx(v_uv);
    vec2 y = dFdy(v_uv);
    // One whole mip, because a lookup between two reads both.
    vec2 texels = vec2(textureSize(u_color, 0));
    float widest = max(dot(x * texels, x * texels), dot(y * texels, y * texels));
    float mip = max(floor(0.5 * log2(max(widest, 1e-12)) - 1.5), 0.0);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 4; ++i) {
        vec4 texel = textureLod(u_color, uv + places[i].x * x + places[i].y * y, mip);
        alphas[i] = texel.a;
        sum += texel;
    }
    return 0.25 * sum;
}
#endif

void main() {
    apply_clip();
    vec2 uv = v_uv;
#if POINT_LIGHTS && !VERTEX_LIT
    light_set = v_light_set;
#endif
#if !VERTEX_LIT
    vec3 to_eye = eye.xyz - v_position;
    float facing = gl_FrontFacing ? 1.0 : -1.0;
    vec3 geometric = safe_normalize(v_normal, vec3(0.0, 1.0, 0.0)) * facing;

    if (material.has_height > 0.5 && material.parallax.x > 0.0) {
        vec3 v = safe_normalize(to_eye, geometric);
        vec4 tangent = v_tangent;
#if SECOND_UV
        // Relief lies on the first coordinates; tangents follow the normals' on the second.
        if (material.has_second_normal > 0.5) {
            tangent = tangent_on_screen(v_position, v_uv, safe_normalize(v_normal, geometric));
        }
#endif
        vec3 bitangent = tangent.w * cross(v_normal, tangent.xyz);
        uv = parallax_uv(u_height, v_uv, vec3(dot(v, tangent.xyz), dot(v, bitangent), dot(v, v_normal)),
                         material.parallax.x, material.parallax.y);
    }
#endif

#if !COLOR_MAP
    vec4 base = vec4(1.0);
#elif ALPHA_MODE == 1 && ALPHA_TAPS > 1
    vec4 alphas;
    vec4 base = tapped_color(uv, alphas);
#else
    vec4 base = FETCH(u_color);
#endif
    vec4 factor = material.base_color;
#if VERTEX_COLORS
    factor *= clamp(v_color, 0.0, 1.0);
#endif
    base *= factor;
#if !VERTEX_LIT
    // Sample all maps before the discard, because derivatives are undefined after it.
    vec3 local_normal = vec3(0.0, 0.0, 1.0);
#if NORMAL_MAP
    if (material.has_normal > 0.5) {
        local_normal = decode_normal(FETCH(u_normal).rg, 1.0);
    }
#endif
    vec2 gloss = vec2(1.0);
#if GLOSS_MAP
    gloss = material.has_gloss > 0.5 ? FETCH(u_gloss).rg : gloss;
#endif
    vec2 occlusion = vec2(1.0);
#if OCCLUSION_MAP
    occlusion = material.has_occlusion > 0.5 ? FETCH(u_occlusion).rg : occlusion;
#endif
    vec3 emission = material.emission_color;
#if EMISSION_MAP
    emission *= material.has_emission > 0.5 ? FETCH(u_emission).rgb : vec3(1.0);
#endif
#if VERTEX_COLORS == 2
    emission *= clamp(v_color.rgb, 0.0, 1.0);
#endif
#if POINT_LIGHTS
    emission *= light_sets[light_set].state.y;
#endif
#if SECOND_UV
    // A map on second coordinates multiplies the one on first; normals lie on one of them.
    if (material.has_second_normal > 0.5) {
        local_normal = decode_normal(texture(u_second_normal, v_second_uv).rg, 1.0);
    }
    gloss *= material.has_second_gloss > 0.5 ? texture(u_second_gloss, v_second_uv).rg : vec2(1.0);
    vec2 second = material.has_second_occlusion > 0.5 ? texture(u_second_occlusion, v_second_uv).rg : vec2(1.0);
    occlusion = vec2(occlusion.r, material.metalness.y > 0.5 ? occlusion.g : 1.0)
                * vec2(second.r, material.has_second_occlusion > 1.5 ? second.g : 1.0);
    emission *= material.has_second_emission > 0.5 ? texture(u_second_emission, v_second_uv).rgb : vec3(1.0);
    float metalness = material.metalness.x * occlusion.g;
#else
    float metalness = material.metalness.x * mix(1.0, occlusion.g, material.metalness.y);
#endif
    vec3 world_normal = tangent_to_world(local_normal, v_normal, v_tangent) * facing;
    float alpha = filtered_alpha(world_normal, alpha_of_smoothness(gloss.g * material.specular_smoothness.y));
#endif

    float coverage = 1.0;
#if ALPHA_MODE == 1
#if ALPHA_TAPS == 0
    if (base.a < material.alpha_cutoff) {
        discard;
    }
#else
    float edge = max(fwidth(base.a), 1e-3);
#if ALPHA_TAPS > 1 && COLOR_MAP
    coverage = dot(covered(alphas * factor.a, 0.5 * edge), vec4(0.25));
#else
    coverage = covered(vec4(base.a), edge).x;
#endif
    if (coverage <= 0.0) {
        discard;
    }
#endif
#elif ALPHA_MODE == 2
    coverage = base.a;
    if ((coverage > SOLID) != (u_solid > 0.5)) {
        discard;
    }
#endif

#if VERTEX_LIT
    fragment = vec4(base.rgb * (gl_FrontFacing ? v_front : v_back) + v_haze, coverage);
#else
    Surface s = matte_surface(v_position, world_normal, geometric, base.rgb * (1.0 - metalness), v_zenith);
    s.reflector = dielectric_reflector(0.08 * gloss.r * material.specular_smoothness.x);
    s.reflector.metal = base.rgb;
    s.reflector.metalness = metalness;
    s.alpha = alpha;
#if TRANSLUCENT
    s.translucency = material.translucency;
#endif
    s.occlusion = 1.0 + material.occlusion_strength * (occlusion.r - 1.0);
    vec3 color = min(shade(s) + emission, vec3(60000.0)); // the target's half floats end at 65504

#if ALPHA_MODE == 2
    fragment = vec4(u_refracting > 0.5 ? color : apply_haze(color, v_position), coverage);
#else
    if (u_refracting > 0.5) {
        fragment = vec4(color, pack_depth(water.w - v_position.y));
    } else {
        fragment = vec4(apply_haze(color, v_position), coverage);
    }
#endif
#endif
}
