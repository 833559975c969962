#include "lib/clip_frag.glsl"
#include "lib/fog.glsl"

uniform vec3 u_color; // linear

in vec2 v_corner;
in float v_life;

layout(location = 0) out vec4 fragment;

void main() {
    apply_clip();
    // A soft core with four thin rays; it ends inside the quad.
    float r = length(v_corner);
    vec2 a = abs(v_corner);
    float core = exp(-18.0 * r * r);
    float rays = exp(-5.0 * r) * (exp(-28.0 * a.x) + exp(-28.0 * a.y));
    float glow = (core + 0.55 * rays) * clamp(1.0 - r, 0.0, 1.0);
    fragment = vec4(u_color * (2.0 * glow * v_life), 0.0);
}
