// Waves that run up the beach: a thin sheet of water that rises and falls along the slope, foam at its edge, and
// wet sand where it was. A function of place, height and second alone. On a smooth slope the edge of the sheet
// moves like a body that is thrown uphill: M. C. Shen, R. E. Meyer, "Climb of a Bore on a Beach", J. Fluid Mech.
// 16, 1963. Friction makes it return more slowly.
#include "lib/hash.glsl"

uniform vec4 u_swash; // mean height of the highest run-up, m; number and phase [0,1) of the wave; waves in a loop

struct Swash {
    float sheet; // depth of the sheet, m; negative: height above it
    float film;  // share of the wetness that the last waves left, [0,1]
    float foam;  // share of the surface that foam covers, [0,1]
};

const float RISE_SHARE = 0.3; // of a wave's time, in which it runs up
const float BORE_SHARE = 0.4; // of a wave's time, in which the next one breaks
const float BORE_DEPTH = 1.8; // depth in which it breaks, as a multiple of the run-up

// The wave number `wave`: x how high it runs, in run-ups; y a random number.
vec2 swash_reach(float wave, vec2 world, float ragged) {
    float number = wave - u_swash.w * floor(wave / u_swash.w);
    float random = hash21(ivec2(int(number + 0.5), 7));
    // Each wave has its own outline.
    float lobes = value_noise(world * 0.33 + 37.0 * random);
    return vec2(0.34 + 0.36 * random + 0.55 * (lobes - 0.35) + ragged, random);
}

// Foam of an edge: a closed line, and behind it a net that opens. behind: depth behind the edge, in run-ups;
// soft: width of a pixel in the same unit.
float foam_behind(float behind, float net, float soft, float width) {
    float cover = exp(-max(behind, 0.0) / width);
    float line = safe_smoothstep(0.8 - 0.85 * cover, 1.15 - 0.85 * cover, net);
    return line * cover * safe_smoothstep(-0.5 * soft, 0.5 * soft + 0.015, behind);
}

// Wetness of sand that dries. dried: time since the water left it, in waves; after one, nothing is left, as the wave
// after the next one does not know of it.
float wetness(float dried) {
    const float one_wave = 0.11; // exp(-2.2)
    return max(exp(-2.2 * max(dried, 0.0)) - one_wave, 0.0) / (1.0 - one_wave);
}

// Of one wave at its phase [0,1]. height: above calm water, m. footprint_m: width of a pixel on the ground.
Swash swash_of(float wave, float phase, vec2 world, float height, float height_per_pixel, float footprint_m) {
    float run_up = u_swash.x;
    float h = height / run_up;

    // A net of foam: the lines between two fields of noise, one of which drifts there and back. It fades to its mean
    // where a pixel covers it.
    float first = value_noise(world * 2.7);
    float second = value_noise(world * 7.9 - vec2(0.0, 0.9) * abs(2.0 * phase - 1.0) + 2.6 * first);
    float net = 1.0 - abs(first + second - 1.0) * 1.9;
    float resolved = 1.0 / (1.0 + 12.0 * footprint_m * footprint_m);
    net = mix(0.45, net, resolved);

    // The outline of wet sand stays where it is while it dries.
    float ragged = 0.2 * (first - 0.5);
    vec2 reach = max(swash_reach(wave, world, ragged), vec2(0.08, 0.0));
    vec2 before = max(swash_reach(wave - 1.0, world, ragged), vec2(0.08, 0.0));
    float rising = clamp(phase / RISE_SHARE, 0.0, 1.0);
    float falling = clamp((phase - RISE_SHARE) / (1.0 - RISE_SHARE), 0.0, 1.0);
    float level = reach.x * (1.0 - (1.0 - rising) * (1.0 - rising)) * (1.0 - falling * falling);
    float soft = max(height_per_pixel / run_up, 0.002);

    Swash s;
    s.sheet = (level - h) * run_up;
    // The edge of the sheet carries foam up and leaves it where it turns.
    float strength = mix(1.0, 0.55 + 0.45 * reach.y, rising) * (1.0 - 0.75 * safe_smoothstep(0.0, 0.8, falling));
    s.foam = strength * foam_behind(level - h, net, soft, mix(0.3, 0.1, falling));
    float stranded = foam_behind(reach.x - h, net, soft, 0.05) * step(level, h) * step(RISE_SHARE, phase);
    s.foam = max(s.foam, 0.5 * stranded * (1.0 - safe_smoothstep(0.1, 0.6, falling)));
    // The next wave breaks and comes.
    float breaking = (phase - (1.0 - BORE_SHARE)) / BORE_SHARE;
    float bore = BORE_DEPTH * (1.0 - breaking);
    s.foam = max(s.foam, safe_smoothstep(0.0, 0.7, breaking) * foam_behind(-h - bore, net, soft, 0.3));

    // The sand dries from the second on in which the water left it.
    float now = phase - RISE_SHARE - (1.0 - RISE_SHARE) * sqrt(clamp(1.0 - h / reach.x, 0.0, 1.0));
    float last = phase + 1.0 - RISE_SHARE - (1.0 - RISE_SHARE) * sqrt(clamp(1.0 - h / before.x, 0.0, 1.0));
    float edge = soft + 0.06;
    s.film = max(wetness(now) * safe_smoothstep(0.0, edge, reach.x - h) * step(RISE_SHARE, phase),
                 wetness(last) * safe_smoothstep(0.0, edge, before.x - h));
    s.film = max(s.film, safe_smoothstep(0.0, soft + 0.01, level - h));
    return s;
}

// Each place has its own moment at which a wave begins.
Swash swash_at(vec2 world, float height, float height_per_pixel, float footprint_m) {
    float phase = u_swash.z + 1.4 * value_noise(world * 0.031);
    return swash_of(u_swash.y + floor(phase), fract(phase), world, height, height_per_pixel, footprint_m);
}
