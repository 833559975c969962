// Light that the air scatters towards the eye, and the shadows in it: B. Toth, T. Umenhoffer, "Real-time
// Volumetric Lighting in Participating Media", Eurographics 2009. Each ray looks the shadow map up at
// SHAFT_STEPS places. Where they lie differs in squares of 4 x 4 texels, which shafts_smooth.frag averages:
// A. Keller, W. Heidrich, "Interleaved Sampling", EGWR 2001. Single scattering by the phase function of L. G.
// Henyey and J. L. Greenstein, "Diffuse radiation in the galaxy", 1941.
#include "lib/frame.glsl"
#include "lib/guard.glsl"
#include "lib/view_depth.glsl"

#ifndef SHAFT_STEPS
#define SHAFT_STEPS 12
#endif

// Cosine of the angle to the light below which haze and sky do not hold all that the air scatters.
const float GLARE = 0.86;

uniform sampler2D u_depth;                 // window depth of the picture
uniform sampler2DArrayShadow u_shadow_map; // layer 0 holds the scene's whole square
uniform int u_downsample;                  // picture pixels per texel of ours along an edge
uniform float u_density;                   // share of the light that is scattered per metre
uniform float u_anisotropy;                // of the phase function
uniform float u_range_m;                   // of the air that scatters, from the eye

layout(location = 0) out vec4 fragment; // x: share of the light that reaches the eye; y: depth, of the range

// The 16 places of an ordered dither: B. E. Bayer, ICC 1973. In [0, 1).
float ordered(ivec2 texel) {
    ivec2 p = texel & 3;
    ivec2 q = ivec2(p.x ^ p.y, p.y);
    int rank = ((q.x & 1) << 3) | ((q.y & 1) << 2) | (q.x & 2) | ((q.y & 2) >> 1);
    return (float(rank) + 0.5) / 16.0;
}

float phase(float towards_light) {
    float g = u_anisotropy;
    float base = max(1.0 + g * g - 2.0 * g * towards_light, 1e-4);
    return (1.0 - g * g) / (12.566371 * base * sqrt(base));
}

void main() {
    ivec2 size = textureSize(u_depth, 0);
    ivec2 pixel = min(ivec2(gl_FragCoord.xy) * u_downsample + u_downsample / 2, size - 1);
    float depth = texelFetch(u_depth, pixel, 0).r;
    vec2 corner = (vec2(pixel) + 0.5) * viewport.zw * 2.0 - 1.0;
    // The ray from two points on it: the far plane may lie too far away for the precision of one.
    vec4 near = inverse_view_projection * vec4(corner, -1.0, 1.0);
    vec3 start = near.xyz / near.w;
    vec3 ray = safe_normalize(start - eye.xyz, vec3(0.0, 0.0, 1.0));
    float depth_m = view_depth(depth);
    float per_depth = length(start - eye.xyz) / max(lens.x, 1e-6); // metres along the ray per metre of depth
    float length_m = min(depth_m * per_depth, u_range_m);

    vec3 from = (shadow_from_world * vec4(eye.xyz, 1.0)).xyz;
    vec3 to = (shadow_from_world * vec4(eye.xyz + ray * length_m, 1.0)).xyz;
    float step_m = length_m / float(SHAFT_STEPS);
    float kept = exp(-u_density * step_m); // of the light, over a step
    float first = ordered(ivec2(gl_FragCoord.xy));
    float weight = exp(-u_density * step_m * first);
    float sum = 0.0;
    float all = 0.0;
    for (int i = 0; i < SHAFT_STEPS; ++i) {
        vec3 place = mix(from, to, (float(i) + first) / float(SHAFT_STEPS));
        float lit = texture(u_shadow_map, vec4(place.xy, 0.0, place.z));
        vec2 inside = step(abs(place.xy - 0.5), vec2(0.5)); // beyond the square everything is lit
        sum += weight * mix(1.0, lit, inside.x * inside.y);
        all += weight;
        weight *= kept;
    }
    // Haze and sky hold the light of lit air already, except what the air scatters forward.
    float forward = phase(dot(ray, sun_direction.xyz));
    float held = forward * inversesqrt(1.0 + forward * forward / (phase(GLARE) * phase(GLARE)));
    float share = u_density * step_m * (sum * forward - all * held);
    fragment = vec4(share, min(depth_m / u_range_m, 1.0), 0.0, 1.0);
}
