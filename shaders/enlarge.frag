// Enlarges the picture that post.frag made along x or y, after tone map and encoding, where steps are as large as they
// look: T. Lottes, "FidelityFX Super Resolution 1.0", 2021. Cubic convolution of 4 texels: E. Catmull and R. Rom, "A
// Class of Local Interpolating Splines", 1974; R. Keys, "Cubic Convolution Interpolation for Digital Image Processing",
// 1981. It does not leave the range of the two nearest texels, so that edges have no rings: B. Karis, "High-Quality
// Temporal Supersampling", 2014.

uniform sampler2D u_picture; // sRGB-encoded
uniform vec2 u_along;        // (1, 0) or (0, 1)
uniform float u_texels;      // texels per pixel along that axis

layout(location = 0) out vec4 fragment;

// Weights of the four texels; f: of the way from the second to the third, [0,1).
vec4 weights(float f) {
    return vec4(f * (-0.5 + f * (1.0 - 0.5 * f)), 1.0 + f * f * (-2.5 + 1.5 * f), f * (0.5 + f * (2.0 - 1.5 * f)),
                f * f * (-0.5 + 0.5 * f));
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    ivec2 last = textureSize(u_picture, 0) - 1;
    float place = dot(gl_FragCoord.xy, u_along) * u_texels - 0.5;
    float base = floor(place);
    ivec2 along = ivec2(u_along);
    ivec2 second = pixel + along * (int(base) - pixel);
    vec3 color[4];
    for (int i = 0; i < 4; ++i) {
        color[i] = texelFetch(u_picture, clamp(second + (i - 1) * along, ivec2(0), last), 0).rgb;
    }
    vec4 share = weights(place - base);
    vec3 sum = share.x * color[0] + share.y * color[1] + share.z * color[2] + share.w * color[3];
    fragment = vec4(clamp(sum, min(color[1], color[2]), max(color[1], color[2])), 1.0);
}
