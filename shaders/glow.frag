// The light that a bright spot spills around itself in an eye or a lens: first what is brighter than paper,
// at a fraction of the picture's size (u_step.x > 0 blurs along x, u_step.y along y, neither: gathers).
#include "lib/color.glsl"

uniform sampler2D u_source;  // linear HDR
uniform vec2 u_step;         // one texel of the source along the blur, UV
uniform int u_gather;        // texels of the source that one of ours covers along an edge; 0 blurs
uniform float u_exposure;

in vec2 v_uv;

layout(location = 0) out vec4 fragment;

// Weights by brightness keep one glint from flashing through the whole: B. Karis, "Tone Mapping", 2013.
vec3 gather() {
    ivec2 corner = ivec2(gl_FragCoord.xy) * u_gather;
    ivec2 last = textureSize(u_source, 0) - 1;
    vec4 sum = vec4(0.0);
    for (int y = 0; y < u_gather; ++y) {
        for (int x = 0; x < u_gather; ++x) {
            vec3 c = max(texelFetch(u_source, min(corner + ivec2(x, y), last), 0).rgb, 0.0) * u_exposure;
            float bright = luminance(c);
            vec3 over = c * clamp((bright - 0.9) / max(bright, 1e-4), 0.0, 1.0);
            sum += vec4(over, 1.0) / (1.0 + luminance(over));
        }
    }
    return sum.rgb / max(sum.a, 1e-4);
}

void main() {
    if (u_gather > 0) {
        fragment = vec4(gather(), 1.0);
        return;
    }
    vec3 sum = vec3(0.0);
    float weights = 0.0;
    for (int i = -6; i <= 6; ++i) {
        float w = exp(-0.07 * float(i * i));
        sum += w * texture(u_source, v_uv + float(i) * u_step).rgb;
        weights += w;
    }
    fragment = vec4(sum / weights, 1.0);
}
