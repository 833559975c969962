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
