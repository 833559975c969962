#include "lib/clip_frag.glsl"
#include "lib/fog.glsl"

uniform float u_speck; // 1: an opaque speck; 0: a sparkle that adds light

in vec2 v_corner;
in float v_life;
in vec3 v_color; // linear

layout(location = 0) out vec4 fragment;

void main() {
    apply_clip();
    float r = length(v_corner);
    if (u_speck > 0.5) {
        float cover = v_life * clamp(3.0 - 3.0 * r, 0.0, 1.0);
        fragment = vec4(v_color * cover, cover);
        return;
    }
    // A bright core, a soft halo and four thin rays. All fade out inside the quad.
    vec2 a = abs(v_corner);
    float core = 1.5 * exp(-70.0 * r * r);
    float halo = 0.16 * exp(-4.5 * r);
    float rays = 0.8 * exp(-4.0 * r) * (exp(-45.0 * a.x) + exp(-45.0 * a.y));
    float glow = (core + halo + rays) * clamp(1.0 - r, 0.0, 1.0);
    fragment = vec4(v_color * (2.0 * glow * v_life), 0.0);
}
