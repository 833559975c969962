#include "lib/frame.glsl"

// Widens alpha by the variance of the normal inside a pixel, so that highlights do not shimmer: Y. Tokuyoshi,
// A. Kaplanyan, "Improved Geometric Specular Antialiasing", I3D 2019.
float filtered_alpha(vec3 n, float alpha) {
    vec3 dx = dFdx(n);
    vec3 dy = dFdy(n);
    float kernel = min(0.25 * ambient.w * ambient.w * (dot(dx, dx) + dot(dy, dy)), 0.18);
    return sqrt(clamp(alpha * alpha + kernel, 0.0, 1.0));
}
