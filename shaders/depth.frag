// Leaves out transparent texels, so that leaves cast shadows of their own shape. What is blended leaves out a
// share of its texels in a fixed pattern, which the filter of the shadow map makes a lighter shadow: E.
// Enderton et al., "Stochastic Transparency", I3D 2010. Macro ALPHA_MODE as in object.frag.
#include "lib/hash.glsl"

#ifndef ALPHA_MODE
#define ALPHA_MODE 0
#endif

#if ALPHA_MODE
uniform sampler2D u_color;
uniform float u_has_color; // 1: there is a colour map; 0: there is none
uniform float u_opacity;   // multiplied with the map's alpha
uniform float u_alpha_cutoff;

in vec2 v_uv;
in float v_alpha;
#endif

void main() {
#if ALPHA_MODE
    float alpha = u_opacity * clamp(v_alpha, 0.0, 1.0) * (u_has_color > 0.5 ? texture(u_color, v_uv).a : 1.0);
#if ALPHA_MODE == 1
    float least = u_alpha_cutoff;
#else
    float least = max(gradient_noise(gl_FragCoord.xy), 1e-3);
#endif
    if (alpha < least) {
        discard;
    }
#endif
}
