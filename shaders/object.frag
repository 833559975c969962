#include "lib/clip_frag.glsl"
#include "lib/fog.glsl"
#include "lib/light.glsl"
#include "lib/normal.glsl"
#include "lib/parallax.glsl"

uniform sampler2D u_color;
uniform sampler2D u_normal;
uniform sampler2D u_height;
uniform sampler2D u_gloss;          // R specular intensity, G smoothness
uniform vec3 u_base_color;          // linear, multiplied with the colour map
uniform float u_has_color;          // 1: there is a colour map; 0: there is none
uniform float u_has_normal;
uniform float u_has_height;
uniform float u_has_gloss;
uniform vec2 u_parallax;            // scale, bias
uniform vec2 u_specular_smoothness; // specular, smoothness; multiplied with the gloss map
uniform float u_alpha_cutoff;       // 0: opaque
uniform float u_translucency;
uniform float u_multisampled;       // 1: alpha becomes coverage; 0: discards fragments below the cutoff

in vec3 v_position;
in vec3 v_normal;
in vec4 v_tangent;
in vec2 v_uv;

layout(location = 0) out vec4 fragment;

// With ray marching, neighbouring pixels may hit distant points of the relief. Gradients of the surface's UV
// avoid too coarse mips there.
#if PARALLAX_STEPS > 2
#define FETCH(map) textureGrad(map, uv, dFdx(v_uv), dFdy(v_uv))
#else
#define FETCH(map) texture(map, uv)
#endif

void main() {
    apply_clip();
    vec3 to_eye = eye.xyz - v_position;
    float facing = gl_FrontFacing ? 1.0 : -1.0;
    vec3 geometric = safe_normalize(v_normal, vec3(0.0, 1.0, 0.0)) * facing;

    vec2 uv = v_uv;
    if (u_has_height > 0.5 && u_parallax.x > 0.0) {
        vec3 v = safe_normalize(to_eye, geometric);
        vec3 bitangent = v_tangent.w * cross(v_normal, v_tangent.xyz);
        uv = parallax_uv(u_height, v_uv, vec3(dot(v, v_tangent.xyz), dot(v, bitangent), dot(v, v_normal)),
                         u_parallax.x, u_parallax.y);
    }

    vec4 texel = u_has_color > 0.5 ? FETCH(u_color) : vec4(1.0);
    // Sample all maps before the discard, because derivatives are undefined after it.
    vec3 local_normal = u_has_normal > 0.5 ? decode_normal(FETCH(u_normal).rg, 1.0) : vec3(0.0, 0.0, 1.0);
    vec2 gloss = u_has_gloss > 0.5 ? FETCH(u_gloss).rg : vec2(1.0);
    vec3 world_normal = tangent_to_world(local_normal, v_normal, v_tangent) * facing;
    float alpha = filtered_alpha(world_normal, alpha_of_smoothness(gloss.g * u_specular_smoothness.y));
    float texel_step = fwidth(texel.a);

    float coverage = 1.0;
    if (u_alpha_cutoff > 0.0) {
        if (u_multisampled > 0.5) {
            // Sharpens alpha to an edge of one pixel at any distance: B. Golus, "Anti-aliased Alpha Test",
            // 2017.
            coverage = clamp((texel.a - u_alpha_cutoff) / max(texel_step, 1e-3) + 0.5, 0.0, 1.0);
            if (coverage <= 0.0) {
                discard;
            }
        } else if (texel.a < u_alpha_cutoff) {
            discard;
        }
    }

    Surface s = matte_surface(v_position, world_normal, geometric, texel.rgb * u_base_color);
    s.f0 = clamp(0.08 * gloss.r * u_specular_smoothness.x, 0.0, 1.0);
    s.alpha = alpha;
    s.translucency = u_translucency;
    vec3 color = shade(s);

    if (u_refracting > 0.5) {
        fragment = vec4(color, pack_depth(water.w - v_position.y));
    } else {
        fragment = vec4(apply_haze(color, v_position), coverage);
    }
}
