// Fresnel reflectance of a dielectric: C. Schlick, "An Inexpensive BRDF Model for Physically-based
// Rendering", Computer Graphics Forum 13(3), 1994. `cosine` is clamped, because rounding may carry it outside
// [0,1].
float fresnel_schlick(float f0, float cosine) {
    float m = 1.0 - clamp(cosine, 0.0, 1.0);
    float m2 = m * m;
    return f0 + (1.0 - f0) * m2 * m2 * m;
}
vec3 fresnel_schlick(vec3 f0, float cosine) {
    return vec3(fresnel_schlick(f0.r, cosine), fresnel_schlick(f0.g, cosine), fresnel_schlick(f0.b, cosine));
}
