// Projects world positions to the screen.
#include "lib/clip_vert.glsl"
#include "lib/frame.glsl"

// 1, or the index of refraction of water in the refraction view
uniform float u_refraction_index;

// Horizontal distance from the eye at which a ray enters calm water on its way to a point. The point is
// `depth` below the surface and `distance_m` away horizontally; the eye is `height` above the surface. Solves
// Snell's law by Newton's method. The function is concave, so that steps from 0 never overshoot.
float entry_distance(float distance_m, float depth, float height, float refraction_index) {
    float x = 0.0;
    for (int i = 0; i < 5; ++i) {
        float slant = x * x + height * height;
        float sine = x * inversesqrt(slant);
        float rest = max(refraction_index * refraction_index - sine * sine, 1e-3);
        float value = x + depth * sine * inversesqrt(rest) - distance_m;
        float slope = 1.0 + depth * refraction_index * refraction_index * height * height *
                                inversesqrt(slant * slant * slant) * inversesqrt(rest * rest * rest);
        x = clamp(x - value / slope, 0.0, distance_m);
    }
    return x;
}

// Writes gl_Position and the clip distance of a world position. In the refraction view, points below the
// water are lifted to where they appear through a calm surface.
void write_position(vec3 world) {
    write_clip(world);
    vec3 seen = world;
    float depth = water.w - world.y;
    float height = eye.y - water.w;
    if (u_refraction_index > 1.0 && depth > 0.0 && height > 0.0) {
        float distance_m = distance(world.xz, eye.xz);
        float entry_m = entry_distance(distance_m, depth, max(height, 0.01), u_refraction_index);
        // Height of the straight line through the entry point, above the point. Directly below the eye this
        // is depth / index.
        float apparent_depth = entry_m > 0.01 * height ? (distance_m - entry_m) * height / entry_m
                                                       : depth / u_refraction_index;
        seen.y = water.w - min(apparent_depth, depth);
    }
    gl_Position = view_projection * vec4(seen, 1.0);
}
