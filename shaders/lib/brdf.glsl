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

// Share of the light from all around that microfacets reflect towards v in one bounce, as factors of f0 and of 1
// (Schlick's term): B. Karis, "Real Shading in Unreal Engine 4", 2013. A fit to the integral of GGX with
// height-correlated Smith, within 0.02 (0.03 where n_v < 0.25, 0.05 where it is < 0.2).
vec2 directional_albedo(float n_v, float alpha) {
    float x = clamp(n_v, 0.0, 1.0);
    float y = clamp(alpha, 0.0, 1.0);
    vec4 r = vec4(0.0314, 0.9785, 1.0, 1.0) + x * vec4(2.4749, -2.3847, 0.1221, 1.1987) +
             y * vec4(9.5588, 5.2126, 7.9384, 22.166) + x * y * vec4(-22.3715, -10.2072, -8.8884, -103.1341) +
             x * x * vec4(12.7153, 1.4258, 14.1027, 11.8017) + y * y * vec4(-8.6198, -2.5485, -7.8768, 72.3962) +
             x * x * y * vec4(16.3608, 4.9951, 2.0996, 195.2155) +
             x * y * y * vec4(34.3296, 3.9869, 28.8602, 506.838) +
             x * x * y * y * vec4(-31.6128, -1.4268, 5.5357, -662.5479);
    return clamp(r.xy / r.zw, 0.0, 1.0);
}

// The reflection of a surface: a share of it as a metal, the rest as a non-metal.
struct Reflector {
    float dielectric; // reflectance of the non-metal at normal incidence, f0
    vec3 metal;       // of the metal
    float metalness;  // the metal's share
};

Reflector dielectric_reflector(float f0) { return Reflector(clamp(f0, 0.0, 1.0), vec3(0.0), 0.0); }

vec3 reflectance_f0(Reflector r) { return mix(vec3(r.dielectric), r.metal, r.metalness); }

// Reflectance at grazing angles, f90. A metal's is 1. A non-metal's falls to 0 below f0 = 0.02: S. Lagarde, 2011.
// They mix as in The Khronos Group, "KHR_materials_specular", 2023: what dims the non-metal leaves the metal as it is.
float reflectance_f90(Reflector r) { return mix(clamp(50.0 * r.dielectric, 0.0, 1.0), 1.0, r.metalness); }

// Reflectance of a non-metal for one direction of light. It fades out below f0 = 0.02.
float dielectric_fresnel(float f0, float cosine) { return fresnel_schlick(f0, cosine) * smoothstep(0.0, 0.02, f0); }

// Factor on the sun's light of one bounce for what bounces again between microfacets, which else is lost: rough
// metals would be dark. E. Turquin, "Practical multiple scattering compensation for microfacet models", 2019.
// factors: directional_albedo(). It is the same for all lights: the width of a light's own highlight hardly changes it.
vec3 multiple_scattering(vec3 f0, vec2 factors) {
    return 1.0 + f0 * (1.0 / max(factors.x + factors.y, 0.1) - 1.0);
}

// Reflectance of light from all around towards v, with all bounces: C. Fdez-Aguera, "A Multiple-Scattering
// Microfacet Model for Real-Time Image-based Lighting", JCGT 8(1), 2019.
// factors: directional_albedo().
vec3 environment_reflectance(Reflector r, vec2 factors) {
    vec3 f0 = reflectance_f0(r);
    vec3 mean_fresnel = f0 + (1.0 - f0) / 21.0;
    vec3 once = f0 * factors.x + reflectance_f90(r) * factors.y;
    return once / max(1.0 - mean_fresnel * (1.0 - factors.x - factors.y), vec3(1e-3));
}

// Specular reflectance of light from direction l towards v in one bounce, including the factor n.l, at most `limit`.
vec3 specular_ggx(vec3 n, vec3 v, vec3 l, Reflector r, float alpha, float limit) {
    float n_l = dot(n, l);
    if (n_l <= 0.0) {
        return vec3(0.0);
    }
    vec3 h = safe_normalize(v + l, n);
    float n_v = max(dot(n, v), 1e-3);
    float n_h = clamp(dot(n, h), 0.0, 1.0);
    float v_h = dot(v, h);
    vec3 f = mix(vec3(dielectric_fresnel(r.dielectric, v_h)), fresnel_schlick(r.metal, v_h), r.metalness);
    return min(ggx_distribution(n_h, alpha) * ggx_visibility(n_l, n_v, alpha) * f * n_l, vec3(limit));
}

// Share of the light from l that enters a non-metal instead of being reflected towards v at its surface: The Khronos Group,
// "glTF 2.0 Specification", 2021, appendix B.2.1 (fresnel_mix).
float sun_entering(vec3 n, vec3 v, vec3 l, float f0) {
    return 1.0 - dielectric_fresnel(f0, dot(v, safe_normalize(v + l, n)));
}

// Share of the light from all around that a rough surface reflects where `occlusion` of it arrives: S.
// Lagarde, C. de Rousiers, "Moving Frostbite to Physically Based Rendering", SIGGRAPH 2014; their roughness is alpha.
float specular_occlusion(float n_v, float occlusion, float alpha) {
    if (occlusion >= 1.0) {
        return 1.0;
    }
    float base = clamp(n_v, 0.0, 1.0) + occlusion;
    return clamp(safe_pow(base, exp2(-16.0 * alpha - 1.0)) - 1.0 + occlusion, 0.0, 1.0);
}
