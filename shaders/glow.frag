// Glow around bright pixels, as in an eye or a lens: reduces the picture and keeps what is brighter than 0.9.
// glow_blur.frag spreads it.
#include "lib/color.glsl"

uniform sampler2D u_source; // linear HDR
uniform int u_downsample;   // source texels per texel of ours along an edge
uniform float u_exposure;

layout(location = 0) out vec4 fragment;

// Weights samples by brightness, so that a single bright pixel does not flicker: B. Karis, "Tone Mapping",
// 2013.
void main() {
    ivec2 corner = ivec2(gl_FragCoord.xy) * u_downsample;
    ivec2 last = textureSize(u_source, 0) - 1;
    vec4 sum = vec4(0.0);
    for (int y = 0; y < u_downsample; ++y) {
        for (int x = 0; x < u_downsample; ++x) {
            vec3 c = max(texelFetch(u_source, min(corner + ivec2(x, y), last), 0).rgb, 0.0) * u_exposure;
            float brightness = luminance(c);
            vec3 excess = c * clamp((brightness - 0.9) / max(brightness, 1e-4), 0.0, 1.0);
            sum += vec4(excess, 1.0) / (1.0 + luminance(excess));
        }
    }
    fragment = vec4(sum.rgb / max(sum.a, 1e-4), 1.0);
}
