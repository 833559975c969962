// Distance from the eye's plane in metres of a window depth in [0, 1]. lens.xy holds the near and far planes.
#include "lib/frame.glsl"

float view_depth(float window_depth) {
    return lens.x * lens.y / max(lens.y - window_depth * (lens.y - lens.x), 1e-6);
}
