// Filmic curve: K. Narkowicz, "ACES Filmic Tone Mapping Curve", 2015, a fit of the Academy's reference
// rendering transform. Linear scene radiance after exposure -> linear display light in [0,1].
vec3 tone_map(vec3 color) {
    vec3 x = min(max(color, 0.0), vec3(1e4));
    return clamp((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0);
}
