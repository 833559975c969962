#include "lib/frame.glsl"
#include "lib/fresnel.glsl"
#include "lib/guard.glsl"

const float PI = 3.14159265358979;

// GGX roughness alpha of a smoothness in [0,1]: (1 - s)^2, with a lower limit to stay representable.
float alpha_of_smoothness(float smoothness) {
    float rough = 1.0 - clamp(smoothness, 0.0, 1.0);
    return max(rough * rough, 0.002);
}

// GGX: B. Walter et al., "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007.
float ggx_distribution(float n_h, float alpha) {
    float a2 = alpha * alpha;
    float d = n_h * n_h * (a2 - 1.0) + 1.0;
    return a2 / (PI * max(d * d, 1e-8));
}

// Visibility G / (4 n_l n_v): height-correlated Smith, approximated as in E. Hammon, "PBR Diffuse Lighting
// for GGX+Smith Microsurfaces", GDC 2017.
float ggx_visibility(float n_l, float n_v, float alpha) {
    float smith = mix(2.0 * n_l * n_v, n_l + n_v, alpha);
    return 0.5 / max(smith, 1e-4);
}

float largest(vec3 v) { return max(max(v.r, v.g), v.b); }

// Share of the light from all around that microfacets reflect towards v in one bounce: fit of B. Karis,
// "Physically Based Shading on Mobile", 2014. Below f0 = 0.02 the grazing term fades out too: S. Lagarde, 2011.
vec3 single_scattering(vec3 f0, float n_v, float alpha) {
    vec4 r = sqrt(clamp(alpha, 0.0, 1.0)) * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    float a = min(r.x * r.x, exp2(-9.28 * clamp(n_v, 0.0, 1.0))) * r.x + r.y;
    vec2 ab = vec2(-1.04, 1.04) * a + r.zw;
    return max(f0 * ab.x + clamp(50.0 * largest(f0), 0.0, 1.0) * ab.y, vec3(0.0));
}

// Factor on the light of one bounce for what bounces again between microfacets, which else is lost: rough
// metals would be dark. E. Turquin, "Practical multiple scattering compensation for microfacet models", 2019.
vec3 multiple_scattering(vec3 f0, float n_v, float alpha) {
    float once = single_scattering(vec3(1.0), n_v, alpha).r;
    return 1.0 + f0 * (1.0 / clamp(once, 0.1, 1.0) - 1.0);
}

// Reflectance of environment light towards v.
vec3 environment_reflectance(vec3 f0, float n_v, float alpha) {
    return single_scattering(f0, n_v, alpha) * multiple_scattering(f0, n_v, alpha);
}

// Specular reflectance of light from direction l towards v, including the factor n.l, at most `limit`. f0 is
// the reflectance at normal incidence.
vec3 specular_ggx(vec3 n, vec3 v, vec3 l, vec3 f0, float alpha, float limit) {
    float n_l = dot(n, l);
    if (n_l <= 0.0) {
        return vec3(0.0);
    }
    vec3 h = safe_normalize(v + l, n);
    float n_v = max(dot(n, v), 1e-3);
    float n_h = clamp(dot(n, h), 0.0, 1.0);
    vec3 f = fresnel_schlick(f0, dot(v, h)) * smoothstep(0.0, 0.02, largest(f0));
    f *= multiple_scattering(f0, n_v, alpha);
    return min(ggx_distribution(n_h, alpha) * ggx_visibility(n_l, n_v, alpha) * f * n_l, vec3(limit));
}

// Widens alpha by the variance of the normal inside a pixel, so that highlights do not shimmer: Y. Tokuyoshi,
// A. Kaplanyan, "Improved Geometric Specular Antialiasing", I3D 2019.
float filtered_alpha(vec3 n, float alpha) {
    vec3 dx = dFdx(n);
    vec3 dy = dFdy(n);
    float kernel = min(0.25 * ambient.w * ambient.w * (dot(dx, dx) + dot(dy, dy)), 0.18);
    return sqrt(clamp(alpha * alpha + kernel, 0.0, 1.0));
}

// Share of the light from all around that a rough surface reflects where `occlusion` of it arrives: S.
// Lagarde, C. de Rousiers, "Moving Frostbite to Physically Based Rendering", SIGGRAPH 2014.
float specular_occlusion(float n_v, float occlusion, float alpha) {
    if (occlusion >= 1.0) {
        return 1.0;
    }
    float base = clamp(n_v, 0.0, 1.0) + occlusion;
    return clamp(safe_pow(base, exp2(-16.0 * sqrt(alpha) - 1.0)) - 1.0 + occlusion, 0.0, 1.0);
}
