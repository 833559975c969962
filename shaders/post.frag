#include "lib/color.glsl"
#include "lib/frame.glsl"
#include "lib/hash.glsl"
#include "lib/tonemap.glsl"

uniform sampler2D u_picture;   // linear HDR
uniform sampler2D u_glow;      // glow after exposure
uniform float u_glow_strength; // share of the glow that is added

in vec2 v_uv;

layout(location = 0) out vec4 fragment;

void main() {
    vec3 color = texelFetch(u_picture, ivec2(gl_FragCoord.xy), 0).rgb * clock.z;
    color += u_glow_strength * texture(u_glow, v_uv).rgb;
    vec3 encoded = srgb_encode(tone_map(color));
    // Static triangular dither of one 8-bit step, against banding: L. Roberts, "Picture Coding Using
    // Pseudo-Random Noise", 1962. The second pattern lies across the first: moved along, it would follow it, and the
    // sum would be half as wide and not triangular.
    float dither = gradient_noise(gl_FragCoord.xy) + gradient_noise(gl_FragCoord.yx + vec2(47.0, 17.0)) - 1.0;
    fragment = vec4(encoded + dither * (0.5 / 255.0), 1.0);
}
