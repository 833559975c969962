// From the world to the screen.
#include "lib/clip_vert.glsl"
#include "lib/frame.glsl"

// 1, or in the refraction view the index of refraction of water.
uniform float u_index;

// How far from the eye, horizontally, a ray enters calm water to reach a point `depth` below it and `reach`
// metres away, from an eye `height` above it: Snell's law, solved by Newton's method. The function is
// concave, so from 0 the steps never overshoot.
float entry_distance(float reach, float depth, float height, float index) {
    float x = 0.0;
    for (int i = 0; i < 5; ++i) {
        float slant = x * x + height * height;
        float sine = x * inversesqrt(slant);
        float rest = max(index * index - sine * sine, 1e-3);
        float value = x + depth * sine * inversesqrt(rest) - reach;
        float slope = 1.0 + depth * index * index * height * height * inversesqrt(slant * slant * slant) *
                                inversesqrt(rest * rest * rest);
        x = clamp(x - value / slope, 0.0, reach);
    }
    return x;
}

// Writes gl_Position and the clip distance of a world position. In the refraction view what lies below the water
// is drawn where it is seen through calm water, lifted towards the surface: a pole is bent where it enters.
void place(vec3 world) {
    write_clip(world);
    vec3 seen = world;
    float depth = water.w - world.y;
    float height = eye.y - water.w;
    if (u_index > 1.0 && depth > 0.0 && height > 0.0) {
        float reach = distance(world.xz, eye.xz);
        float entry = entry_distance(reach, depth, max(height, 0.01), u_index);
        // Above the point, upon the straight line through the entry; straight below the eye the limit.
        float shown = entry > 0.01 * height ? (reach - entry) * height / entry : depth / u_index;
        seen.y = water.w - min(shown, depth);
    }
    gl_Position = view_projection * vec4(seen, 1.0);
}
