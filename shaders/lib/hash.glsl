// Integer hash: PCG2D of M. Jarzynski, M. Olano, "Hash Functions for GPU Rendering", JCGT 9(3), 2020.
uvec2 pcg2d(uvec2 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * 1664525u;
    v.y += v.x * 1664525u;
    v = v ^ (v >> 16u);
    v.x += v.y * 1664525u;
    v.y += v.x * 1664525u;
    v = v ^ (v >> 16u);
    return v;
}

float hash21(ivec2 cell) { return float(pcg2d(uvec2(cell)).x >> 8u) * (1.0 / 16777216.0); }

// Value noise in [0,1] with quintic interpolation: K. Perlin, "Improving Noise", SIGGRAPH 2002.
float value_noise(vec2 p) {
    vec2 base = floor(p);
    vec2 f = p - base;
    ivec2 cell = ivec2(base);
    vec2 w = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    float a = hash21(cell);
    float b = hash21(cell + ivec2(1, 0));
    float c = hash21(cell + ivec2(0, 1));
    float d = hash21(cell + ivec2(1, 1));
    return mix(mix(a, b, w.x), mix(c, d, w.x), w.y);
}

// Interleaved gradient noise: J. Jimenez, "Next Generation Post Processing in Call of Duty: Advanced
// Warfare", SIGGRAPH 2014. Static: it depends on the pixel, not on time.
float gradient_noise(vec2 pixel) { return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715)))); }
