// Glow around bright pixels, as in an eye or a lens. First pass: reduces the picture and keeps what is
// brighter than 0.9. Then two blur passes, along x and along y (u_blur_step).
#include "lib/color.glsl"

uniform sampler2D u_source; // linear HDR
uniform vec2 u_blur_step;   // step of the blur: one texel of the source along x or y, UV
uniform int u_downsample;   // source texels per texel of ours along an edge; 0: blur
uniform float u_exposure;

in vec2 v_uv;

layout(location = 0) out vec4 fragment;

// Weights samples by brightness, so that a single bright pixel does not flicker: B. Karis, "Tone Mapping",
// 2013.
vec3 downsample() {
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
    return sum.rgb / max(sum.a, 1e-4);
}

void main() {
    if (u_downsample > 0) {
        fragment = vec4(downsample(), 1.0);
        return;
    }
    vec3 sum = vec3(0.0);
    float weights = 0.0;
    for (int i = -6; i <= 6; ++i) {
        float w = exp(-0.07 * float(i * i));
        sum += w * texture(u_source, v_uv + float(i) * u_blur_step).rgb;
        weights += w;
    }
    fragment = vec4(sum / weights, 1.0);
}
