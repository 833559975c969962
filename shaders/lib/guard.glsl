// Functions that stay finite for every finite input. Plain normalize(0), pow(negative, y) and division by
// zero give NaN, and one NaN pixel spreads through every filter that follows.

// v / |v|, or `fallback` where v is too short to have a direction.
vec3 safe_normalize(vec3 v, vec3 fallback) {
    float squared = dot(v, v);
    return squared > 1e-20 ? v * inversesqrt(squared) : fallback;
}

// base^exponent for base clamped to [0, inf); pow(0, 0) is undefined in GLSL, here 0.
float safe_pow(float base, float exponent) { return base > 0.0 ? pow(base, exponent) : 0.0; }

// smoothstep whose edges may be equal or reversed in order: then a hard step at `low`.
float safe_smoothstep(float low, float high, float x) {
    float t = high > low ? clamp((x - low) / (high - low), 0.0, 1.0) : (x < low ? 0.0 : 1.0);
    return t * t * (3.0 - 2.0 * t);
}

float saturate(float x) { return clamp(x, 0.0, 1.0); }
