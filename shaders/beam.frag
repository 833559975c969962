// Light that the haze scatters out of a beam. Across the beam its density is a bell curve, whose integral along a
// ray that passes it at an angle is again one, of the ray's distance to the axis.
#include "lib/beam.glsl"
#include "lib/clip_frag.glsl"
#include "lib/fog.glsl"

in vec3 v_position;
in vec3 v_place;
in vec3 v_color;

layout(location = 0) out vec4 fragment;

const float SCATTERED_PER_M = 0.0024; // of the beam's light, towards the eye

void main() {
    apply_clip();
    vec3 ray = v_position - eye.xyz;
    float distance_m = max(length(ray), 1e-3);
    // Where the eye looks along the beam the ray is long inside it.
    float across = max(length(ray.xz) / distance_m, 0.15);
    float width = beam_width(v_place.y);
    float x = v_place.x / width;
    float bell = max(exp(-x * x) - 0.002, 0.0);
    // All of the light passes through each height: the wider the beam, the dimmer.
    float left = 1.0 - clamp(v_place.z, 0.0, 1.0);
    float light = bell / (width * across) * left * left * smoothstep(0.0, 0.25, v_place.y);
    vec3 seen = vec3(1.0) - haze_amount(distance_m);
    fragment = vec4(min(v_color * (SCATTERED_PER_M * light) * seen, vec3(100.0)), 0.0);
}
