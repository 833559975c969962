// Makes one picture of the samples of each pixel. Their plain mean follows the brightest sample, and where dark meets
// bright the tone map then leaves steps as without antialiasing. So the mean is taken of what the tone map makes of
// them, and turned back into linear light: T. Lottes, "Optimized Reversible Tonemapper for Resolve", 2016; M. Pettineo,
// "Experimenting with Reconstruction Filters for MSAA Resolve", 2012.
#include "lib/frame.glsl"
#include "lib/tonemap.glsl"

#ifndef SAMPLES
#define SAMPLES 4
#endif

#ifdef GL_ES // GLSL ES 300 has no multisampled textures: the driver takes the plain mean
uniform sampler2D u_samples;
#else
uniform sampler2DMS u_samples; // linear HDR
#endif

layout(location = 0) out vec4 fragment;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
#ifdef GL_ES
    fragment = texelFetch(u_samples, pixel, 0);
#else
    float exposure = max(clock.z, 1e-6);
    vec3 sum = vec3(0.0);
    vec3 plain = vec3(0.0);
    for (int i = 0; i < SAMPLES; ++i) {
        vec3 light = texelFetch(u_samples, pixel, i).rgb;
        plain += light;
        sum += reversible_tone_map(light * exposure);
    }
    // The tone map would hide a NaN or an infinity, which --check-finite looks for.
    bool bad = any(isnan(plain)) || any(isinf(plain));
    fragment = bad ? vec4(plain, 1.0) : vec4(reversed_tone_map(sum / float(SAMPLES)) / exposure, 1.0);
#endif
}
