// Leaves out transparent texels, so that leaves cast shadows of their own shape. What is blended leaves out a
// share of its texels in a fixed pattern, which the filter of the shadow map makes a lighter shadow: E.
// Enderton et al., "Stochastic Transparency", I3D 2010. Macro ALPHA_MODE as in object.frag.
#include "lib/hash.glsl"
#include "lib/material.glsl"

#ifndef ALPHA_MODE
#define ALPHA_MODE 0
#endif

#if ALPHA_MODE
uniform sampler2D u_color;

in vec2 v_uv;
in float v_alpha;
#endif

void main() {
#if ALPHA_MODE
    float texel = material.has_color > 0.5 ? texture(u_color, v_uv).a : 1.0;
    float alpha = material.base_color.a * clamp(v_alpha, 0.0, 1.0) * texel;
#if ALPHA_MODE == 1
    float least = material.alpha_cutoff;
#else
    float least = max(gradient_noise(gl_FragCoord.xy), 1e-3);
#endif
    if (alpha < least) {
        discard;
    }
#endif
}
