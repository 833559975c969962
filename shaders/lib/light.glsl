// Light of sun and sky on a surface.
#include "lib/brdf.glsl"
#include "lib/frame.glsl"
#include "lib/shadow.glsl"
#include "lib/underwater.glsl"
#include "lib/zenith.glsl"

uniform float u_sky_trimmed_mips; // finer mips that the bake left out

// Irradiance / pi of the sky for a surface with normal n. The scene's ambient light sets the value for a
// surface that faces up; the sky's colours give the variation with direction. A coarse mip replaces the
// convolution, because irradiance is smooth: R. Ramamoorthi, P. Hanrahan, "An Efficient Representation for
// Irradiance Environment Maps", SIGGRAPH 2001.
// Macro: SKY_LIGHT 0, in quality `fast`, sees no sky there; default 1.
#ifndef SKY_LIGHT
#define SKY_LIGHT 1
#endif
vec3 sky_ambient(vec3 n, vec3 zenith) {
    if (u_sky_blur < 0.0) {
        return ambient.rgb * (0.75 + 0.25 * n.y);
    }
#if SKY_LIGHT
    return ambient.rgb * min(textureLod(u_sky, n, u_sky_blur).rgb / max(zenith, vec3(1e-4)), vec3(4.0));
#else
    return ambient.rgb * (2.1 - 1.1 * n.y); // skies are brighter at the horizon than at the zenith
#endif
}
// The same of a surface that faces up, without a lookup.
vec3 sky_ambient_up() { return ambient.rgb; }

// Specular reflection of the sky by a rough surface. Without a sky, the light from all around is reflected.
// factors: directional_albedo().
vec3 sky_specular(vec3 n, vec3 v, Reflector reflector, float alpha, vec2 factors, vec3 zenith) {
    vec3 r = reflect(-v, n);
    vec3 share = environment_reflectance(reflector, factors);
    if (u_sky_blur < 0.0) {
        return sky_ambient(r, zenith) * share;
    }
    float lod = (u_sky_blur + u_sky_trimmed_mips) * sqrt(sqrt(alpha)) - u_sky_trimmed_mips;
    return textureLod(u_sky, r, lod).rgb * share;
}

uniform float u_refracting; // 1 in the refraction view, where alpha holds the packed depth

// Light that passes through a leaf is yellower than light that it reflects.
const vec3 TRANSMITTED = vec3(1.35, 1.15, 0.35);

struct Surface {
    vec3 position;       // metres, in the view's coordinates
    vec3 normal;         // unit, from the normal map
    vec3 geometric;      // unit, of the triangle's visible side
    vec3 albedo;         // linear
    Reflector reflector; // what its dielectric reflects does not reach the albedo
    float alpha;         // GGX roughness
    float translucency;  // share of the light from behind that passes through
    float occlusion;     // share of the light from all around that arrives
    vec3 zenith;         // sky_zenith()
};

// An opaque surface without specular reflection. Set the other members afterwards where they apply.
Surface matte_surface(vec3 position, vec3 normal, vec3 geometric, vec3 albedo, vec3 zenith) {
    return Surface(position, normal, geometric, albedo, dielectric_reflector(0.0), 1.0, 0.0, 1.0, zenith);
}

// Macros: DRY 1, nothing is under water; ABOVE_WATER 1, what is under water is not seen; SUNKEN 1, everything is, too deep to reflect; MATTE 1, nothing
// reflects.
#ifndef DRY
#define DRY 0
#endif
#ifndef ABOVE_WATER
#define ABOVE_WATER 0
#endif
#ifndef SUNKEN
#define SUNKEN 0
#endif
#ifndef MATTE
#define MATTE 0
#endif
#ifndef POINT_LIGHTS
#define POINT_LIGHTS 0
#endif
#if POINT_LIGHTS
#include "lib/point_lights.glsl"

// Linear radiance towards v of a surface in the light of the point lights. depth: under the water, metres; above_water: the
// share of its specular reflection that is left; bounces: multiple_scattering().
vec3 shade_by_point_lights(Surface s, vec3 v, vec3 transmitted, float depth, float above_water, vec3 bounces) {
    vec3 color = vec3(0.0);
    int count = light_count();
    for (int i = 0; i < count; ++i) {
        Arriving one = light_at(i, s.position);
        vec3 light = one.light;
        if (depth > 0.0) {
            light *= exp(-min(water.rgb * depth / max(one.direction.y, 0.2), vec3(60.0)));
        }
        float n_l = dot(s.normal, one.direction);
        float direct = max(n_l, 0.0) * smoothstep(-0.05, 0.1, dot(s.geometric, one.direction));
#if !MATTE
        float alpha = widened_alpha(s.alpha, one.spread);
        direct *= mix(1.0, sun_entering(s.normal, v, one.direction, s.reflector.dielectric), above_water);
        color += above_water * light * bounces * specular_ggx(s.normal, v, one.direction, s.reflector, alpha, 16.0);
#endif
        color += (s.albedo * direct + transmitted * (s.translucency * max(-n_l, 0.0))) * (1.0 / PI) * light;
    }
    return color;
}
#endif

// Linear radiance towards the eye, without haze. Includes absorption and caustics under water.
vec3 shade(Surface s) {
    vec3 to_eye = eye.xyz - s.position;
    float distance_m = length(to_eye);
    vec3 v = distance_m > 1e-6 ? to_eye / distance_m : s.normal;
    float depth = water.w - s.position.y;
#if DRY || ABOVE_WATER
    const bool submerged = false;
#elif SUNKEN
    const bool submerged = true;
#else
    bool submerged = depth > 0.0;
#endif
    // Refraction makes the ray steeper under water and changes the flux through the surface.
    vec3 l = submerged ? u_sun_refracted : sun_direction.xyz;

    float facing = dot(s.geometric, l);
    vec3 sun = vec3(0.0);          // after the water
    vec3 unattenuated = vec3(0.0); // before the water
    float direct = max(dot(s.normal, l), 0.0) * smoothstep(-0.05, 0.1, facing);
    float transmission = s.translucency * max(-dot(s.normal, l), 0.0);
    if (direct + transmission > 0.0) {
        sun = sun_radiance.rgb * sun_visibility(s.position, s.geometric * (facing < 0.0 ? -1.0 : 1.0), distance_m);
        unattenuated = sun;
        if (submerged) {
            sun *= sun_through_water(depth) * caustics(s.position, depth);
            // In deep water, light between floor and surface makes up for the lower flux.
            float spread = clamp(sun_direction.y / max(u_sun_refracted.y, 0.2), 0.0, 1.0);
            sun *= mix(spread, 1.0, smoothstep(0.05, 0.8, depth));
        }
    }
    vec3 transmitted = s.albedo * TRANSMITTED;
    vec3 sky = sky_ambient(s.normal, s.zenith) * s.occlusion;
    vec3 ambient_transmission =
        s.translucency > 0.0 ? sky_ambient(-s.normal, s.zenith) * s.translucency * s.occlusion * 0.5 : vec3(0.0);
    if (submerged) {
        sky *= exp(-min(water.rgb * depth * 1.2, vec3(60.0)));
    }
    // Surfaces under water have no specular reflection. It fades out over a few centimetres of depth.
    float above_water = submerged ? (1.0 - smoothstep(0.03, 0.10, depth)) * (1.0 - u_refracting) : 1.0;
    vec3 bounces = vec3(1.0);
#if !MATTE
    float f0 = s.reflector.dielectric;
    vec2 factors = directional_albedo(dot(s.normal, v), s.alpha);
    bounces = multiple_scattering(reflectance_f0(s.reflector), factors);
    if (f0 > 0.0) {
        float reflected = environment_reflectance(dielectric_reflector(f0), factors).r;
        direct *= mix(1.0, sun_entering(s.normal, v, sun_direction.xyz, f0), above_water);
        sky *= 1.0 - above_water * reflected;
    }
#endif
    vec3 color = (s.albedo * direct + transmitted * transmission) * (1.0 / PI) * sun + s.albedo * sky +
                 transmitted * ambient_transmission;
#if !MATTE
    if (max(f0, s.reflector.metalness) > 0.0 && above_water > 0.0) {
        color += above_water * unattenuated * bounces * specular_ggx(s.normal, v, sun_direction.xyz, s.reflector, s.alpha, 16.0);
        color += above_water * sky_specular(s.normal, v, s.reflector, s.alpha, factors, s.zenith) *
                 specular_occlusion(dot(s.normal, v), s.occlusion, s.alpha);
    }
#endif
#if POINT_LIGHTS
    color += shade_by_point_lights(s, v, transmitted, submerged ? depth : 0.0, above_water, bounces);
#endif
    return color;
}

// Adds to the radiance of both sides what light whose direction has the cosine n_l to the normal gives.
void light_both_sides(inout mat2x3 sides, Surface s, float n_l, vec3 light) {
    vec2 cosines = vec2(n_l, -n_l);
    vec2 facing = max(cosines, 0.0);
    vec2 direct = facing * smoothstep(vec2(-0.05), vec2(0.1), cosines);
    vec2 through = s.translucency * facing.yx;
    light *= s.albedo * (1.0 / PI);
    sides[0] += (direct.x + TRANSMITTED * through.x) * light;
    sides[1] += (direct.y + TRANSMITTED * through.y) * light;
}

// shade() of both sides of a surface above the water that reflects nothing and is not bumpy: [0] that of its normal, [1] the
// other. One lookup of the shadow map and one turn of each lamp serve both.
mat2x3 shade_both_sides(Surface s) {
    mat2x3 sky = mat2x3(sky_ambient(s.normal, s.zenith), sky_ambient(-s.normal, s.zenith));
    vec3 through = 0.5 * s.translucency * TRANSMITTED;
    mat2x3 sides = mat2x3(s.albedo * (sky[0] + through * sky[1]), s.albedo * (sky[1] + through * sky[0]));
    float n_l = dot(s.normal, sun_direction.xyz);
    float visible = sun_visibility(s.position, s.normal * (n_l < 0.0 ? -1.0 : 1.0), distance(eye.xyz, s.position));
    light_both_sides(sides, s, n_l, sun_radiance.rgb * visible);
#if POINT_LIGHTS
    int count = light_count();
    for (int i = 0; i < count; ++i) {
        Arriving one = light_at(i, s.position);
        light_both_sides(sides, s, dot(s.normal, one.direction), one.light);
    }
#endif
    return sides;
}
