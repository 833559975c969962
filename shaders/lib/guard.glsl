// Functions that are finite for every finite input. Plain normalize(0), pow(negative, y) and division by zero
// give NaN, and every later filter spreads a NaN.

// v / |v|, or `fallback` if v is too short.
vec3 safe_normalize(vec3 v, vec3 fallback) {
    float squared = dot(v, v);
    return squared > 1e-20 ? v * inversesqrt(squared) : fallback;
}

// base^exponent for base >= 0, else 0. pow(0, 0) is undefined in GLSL and 0 here.
float safe_pow(float base, float exponent) { return base > 0.0 ? pow(base, exponent) : 0.0; }

// smoothstep that allows equal or reversed edges; it is a step at `low` then.
float safe_smoothstep(float low, float high, float x) {
    float t = high > low ? clamp((x - low) / (high - low), 0.0, 1.0) : (x < low ? 0.0 : 1.0);
    return t * t * (3.0 - 2.0 * t);
}

float saturate(float x) { return clamp(x, 0.0, 1.0); }
