// From the world to the screen.
#include "lib/clip_vert.glsl"
#include "lib/frame.glsl"

// 1, or in the refraction view 1 / (index of refraction): how deep a metre of water looks.
uniform float u_apparent_depth;

// Writes gl_Position and the clip distance of a world position. In the refraction view everything below the
// water's level is drawn nearer to the surface than it is (apparent depth, W. Snellius), so that a
// pole is seen bent where it enters the water.
void place(vec3 world) {
    write_clip(world);
    vec3 seen = world;
    float depth = water.w - world.y;
    if (depth > 0.0) {
        seen.y += depth * (1.0 - u_apparent_depth);
    }
    gl_Position = view_projection * vec4(seen, 1.0);
}
