#include "lib/guard.glsl"

// Rec. 709 luminance of linear RGB.
float luminance(vec3 c) { return dot(c, vec3(0.2126, 0.7152, 0.0722)); }

// sRGB encoding, IEC 61966-2-1:1999. The input is clamped to [0,1]; linear 0.5 gives 0.7354 (188 of 255).
vec3 srgb_encode(vec3 linear_color) {
    vec3 c = clamp(linear_color, 0.0, 1.0);
    vec3 low = c * 12.92;
    vec3 high = 1.055 * pow(max(c, vec3(1e-6)), vec3(1.0 / 2.4)) - 0.055;
    return mix(high, low, vec3(lessThanEqual(c, vec3(0.0031308))));
}
