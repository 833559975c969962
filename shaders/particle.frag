#include "lib/clip_frag.glsl"
#include "lib/fog.glsl"

uniform vec3 u_color; // linear

in vec2 v_corner;
in float v_life;

layout(location = 0) out vec4 fragment;

void main() {
    apply_clip();
    // A bright core, a soft halo and four thin rays. All fade out inside the quad.
    float r = length(v_corner);
    vec2 a = abs(v_corner);
    float core = 1.5 * exp(-70.0 * r * r);
    float halo = 0.16 * exp(-4.5 * r);
    float rays = 0.8 * exp(-4.0 * r) * (exp(-45.0 * a.x) + exp(-45.0 * a.y));
    float glow = (core + halo + rays) * clamp(1.0 - r, 0.0, 1.0);
    fragment = vec4(u_color * (2.0 * glow * v_life), 0.0);
}
