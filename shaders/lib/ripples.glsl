// Ripples round what stands in the water: rings that run outwards and fade, a sum of one wave for each circle near
// the eye. player/scene/ripples.hpp finds the circles.
#include "lib/frame.glsl"

uniform vec4 u_rings[8];     // x, z, radius, m; slope at the rim
uniform vec2 u_ripple_state; // number of circles; phase, rad

const float RIPPLE_LENGTH_M = 0.6;
const float RIPPLE_FADE_M = 1.3; // over which their slope falls to 0.37
const float RIPPLE_REACH_M = 4.0;
const float RIPPLE_SEEN_M = 15.0;

// Horizontal part of the normal that they add.
vec2 ripple_tilt(vec2 xz, float distance_m) {
    vec2 tilt = vec2(0.0);
    // A loop of no round where none can be seen, as for the swash.
    int count = distance_m < RIPPLE_SEEN_M ? int(u_ripple_state.x) : 0;
    for (int i = 0; i < count; ++i) {
        vec4 ring = u_rings[i];
        vec2 way = xz - ring.xy;
        float from_middle = sqrt(dot(way, way));
        float away = max(from_middle - ring.z, 0.0);
        float fade = exp(-away / RIPPLE_FADE_M) * (1.0 - smoothstep(0.6 * RIPPLE_REACH_M, RIPPLE_REACH_M, away));
        float angle = away * (6.2831853 / RIPPLE_LENGTH_M) - u_ripple_state.y;
        tilt += way * (ring.w * fade * cos(angle) / max(from_middle, 0.01));
    }
    return tilt * (1.0 - smoothstep(0.5 * RIPPLE_SEEN_M, RIPPLE_SEEN_M, distance_m));
}
