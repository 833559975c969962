#include "lib/clip_frag.glsl"
#include "lib/fog.glsl"
#include "lib/light.glsl"
#include "lib/normal.glsl"
#include "lib/parallax.glsl"

uniform sampler2D u_color;
uniform sampler2D u_normal;
uniform sampler2D u_height;
uniform sampler2D u_gloss;      // R specular intensity, G smoothness
uniform vec3 u_base_color;      // linear, times the colour map
uniform float u_has_color;      // 1: there is such a map; 0: there is none
uniform float u_has_normal;
uniform float u_has_height;
uniform float u_has_gloss;
uniform vec2 u_parallax;        // scale, bias
uniform vec2 u_shine;           // specular, smoothness: factors of the gloss map, or alone without one
uniform float u_alpha_cutoff;   // 0: opaque
uniform float u_translucency;
uniform float u_multisampled;   // 1: alpha becomes coverage; 0: fragments below the cutoff are discarded

in vec3 v_position;
in vec3 v_normal;
in vec4 v_tangent;
in vec2 v_uv;

layout(location = 0) out vec4 fragment;

// Where the ray is followed, neighbouring pixels may meet the relief far apart: the footprint is the surface's.
#if PARALLAX_STEPS > 2
#define FETCH(map) textureGrad(map, uv, dFdx(v_uv), dFdy(v_uv))
#else
#define FETCH(map) texture(map, uv)
#endif

void main() {
    apply_clip();
    vec3 to_eye = eye.xyz - v_position;
    float side = gl_FrontFacing ? 1.0 : -1.0;
    vec3 geometric = safe_normalize(v_normal, vec3(0.0, 1.0, 0.0)) * side;

    vec2 uv = v_uv;
    if (u_has_height > 0.5 && u_parallax.x > 0.0) {
        vec3 v = safe_normalize(to_eye, geometric);
        vec3 bitangent = v_tangent.w * cross(v_normal, v_tangent.xyz);
        uv = parallax_uv(u_height, v_uv, vec3(dot(v, v_tangent.xyz), dot(v, bitangent), dot(v, v_normal)),
                         u_parallax.x, u_parallax.y);
    }

    vec4 texel = u_has_color > 0.5 ? FETCH(u_color) : vec4(1.0);
    // Every fetch stands before the discard: derivatives are undefined after it.
    vec3 relief = u_has_normal > 0.5 ? decode_normal(FETCH(u_normal).rg, 1.0) : vec3(0.0, 0.0, 1.0);
    vec2 gloss = u_has_gloss > 0.5 ? FETCH(u_gloss).rg : vec2(1.0);
    vec3 shaded = tangent_to_world(relief, v_normal, v_tangent) * side;
    float alpha = filtered_alpha(shaded, alpha_of_smoothness(gloss.g * u_shine.y));
    float texel_step = fwidth(texel.a);

    float coverage = 1.0;
    if (u_alpha_cutoff > 0.0) {
        if (u_multisampled > 0.5) {
            // The edge is one pixel wide however near: B. Golus, "Anti-aliased Alpha Test", 2017.
            coverage = clamp((texel.a - u_alpha_cutoff) / max(texel_step, 1e-3) + 0.5, 0.0, 1.0);
            if (coverage <= 0.0) {
                discard;
            }
        } else if (texel.a < u_alpha_cutoff) {
            discard;
        }
    }

    Surface s = matte_surface(v_position, shaded, geometric, texel.rgb * u_base_color);
    s.f0 = clamp(0.08 * gloss.r * u_shine.x, 0.0, 1.0);
    s.alpha = alpha;
    s.translucency = u_translucency;
    vec3 color = shade(s);

    if (u_refracting > 0.5) {
        fragment = vec4(color, pack_depth(water.w - v_position.y));
    } else {
        fragment = vec4(apply_haze(color, v_position), coverage);
    }
}
