// Filmic tone curve with toe, linear middle and shoulder: H. Uchimura, "HDR Theory and Practice", CEDEC 2017
// ("GT tone map"). Input: linear radiance after exposure. Output: linear display light in [0,1].
const float TONE_TOE = 0.22;       // start of the linear part
const float TONE_CONTRAST = 1.33;  // contrast of the toe
const float TONE_SHOULDER = 0.532; // end of the linear part: TONE_TOE + 0.4 * (1 - TONE_TOE)

vec3 tone_map(vec3 color) {
    vec3 x = clamp(color, vec3(0.0), vec3(1e4));
    vec3 toe = TONE_TOE * pow(max(x, vec3(1e-6)) / TONE_TOE, vec3(TONE_CONTRAST));
    vec3 shoulder = 1.0 - (1.0 - TONE_SHOULDER) * exp(-(x - TONE_SHOULDER) / (1.0 - TONE_SHOULDER));
    vec3 low = 1.0 - smoothstep(vec3(0.0), vec3(TONE_TOE), x);
    vec3 high = step(vec3(TONE_SHOULDER), x);
    return clamp(toe * low + x * (1.0 - low - high) + shoulder * high, 0.0, 1.0);
}

// The tone map without its toe, and beyond TONE_END, where it is nearly white, with a logarithm in place of the end of
// the shoulder: so no two colours become one, and it can be reversed.
const float TONE_END = 2.5;
const float TONE_END_VALUE = 1.0 - (1.0 - TONE_SHOULDER) * exp((TONE_SHOULDER - TONE_END) / (1.0 - TONE_SHOULDER));
const float TONE_END_SLOPE = TONE_END * (1.0 - TONE_END_VALUE) / (1.0 - TONE_SHOULDER); // over the logarithm

vec3 reversible_tone_map(vec3 color) {
    vec3 shoulder = clamp(color, TONE_SHOULDER, TONE_END) - TONE_SHOULDER;
    return clamp(color, 0.0, TONE_SHOULDER) +
           (1.0 - TONE_SHOULDER) * (1.0 - exp(-shoulder / (1.0 - TONE_SHOULDER))) +
           TONE_END_SLOPE * log(max(color, TONE_END) / TONE_END);
}

vec3 reversed_tone_map(vec3 mapped) {
    vec3 shoulder = (clamp(mapped, TONE_SHOULDER, TONE_END_VALUE) - TONE_SHOULDER) / (1.0 - TONE_SHOULDER);
    vec3 beyond = max(mapped - TONE_END_VALUE, 0.0) / TONE_END_SLOPE;
    return min(mapped, TONE_SHOULDER) - (1.0 - TONE_SHOULDER) * log(1.0 - shoulder) + TONE_END * (exp(beyond) - 1.0);
}
