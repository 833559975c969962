// Enlarges the picture that post.frag made, after tone map and encoding, where steps are as large as they look:
// T. Lottes, "FidelityFX Super Resolution 1.0", 2021. Cubic convolution of 4 x 4 texels: E. Catmull and R. Rom, "A Class of Local Interpolating Splines", 1974; R. Keys, "Cubic Convolution
// Interpolation for Digital Image Processing", 1981. It does not leave the range of the four nearest texels, so that
// edges have no rings: B. Karis, "High-Quality Temporal Supersampling", 2014.

uniform sampler2D u_picture; // sRGB-encoded
uniform vec2 u_texels;       // texels per pixel, along x and y

layout(location = 0) out vec4 fragment;

// Weights of the four texels along one axis; f: of the way from the second to the third, [0,1).
vec4 weights(float f) {
    return vec4(f * (-0.5 + f * (1.0 - 0.5 * f)), 1.0 + f * f * (-2.5 + 1.5 * f), f * (0.5 + f * (2.0 - 1.5 * f)),
                f * f * (-0.5 + 0.5 * f));
}

void main() {
    vec2 place = gl_FragCoord.xy * u_texels - 0.5;
    vec2 base = floor(place);
    vec4 across = weights(place.x - base.x);
    vec4 down = weights(place.y - base.y);
    ivec2 last = textureSize(u_picture, 0) - 1;
    vec3 sum = vec3(0.0);
    vec3 least = vec3(1.0);
    vec3 most = vec3(0.0);
    for (int y = 0; y < 4; ++y) {
        for (int x = 0; x < 4; ++x) {
            ivec2 texel = clamp(ivec2(base) + ivec2(x, y) - 1, ivec2(0), last);
            vec3 color = texelFetch(u_picture, texel, 0).rgb;
            sum += across[x] * down[y] * color;
            if ((x == 1 || x == 2) && (y == 1 || y == 2)) {
                least = min(least, color);
                most = max(most, color);
            }
        }
    }
    fragment = vec4(clamp(sum, least, most), 1.0);
}
