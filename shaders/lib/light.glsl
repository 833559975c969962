// Sun and sky upon a surface.
#include "lib/brdf.glsl"
#include "lib/frame.glsl"
#include "lib/shadow.glsl"
#include "lib/underwater.glsl"

uniform samplerCube u_sky;   // linear radiance
uniform float u_sky_blur;    // mip of the cube that stands for its irradiance over pi; below 0: no sky
uniform float u_sky_left_out; // finer mips that the cube could have and was not baked with

// Light of the whole sky upon a surface that faces n, over pi. The scene says how much a surface facing up
// gets; the sky's own light says how the other sides differ from it. Coarse mips of the cube are a good
// stand-in for its convolution: R. Ramamoorthi, P. Hanrahan, "An Efficient Representation for Irradiance
// Environment Maps", SIGGRAPH 2001: irradiance is smooth enough for nine numbers.
vec3 sky_ambient(vec3 n) {
    if (u_sky_blur < 0.0) {
        return ambient.rgb * (0.75 + 0.25 * n.y);
    }
    vec3 above = textureLod(u_sky, vec3(0.0, 1.0, 0.0), u_sky_blur).rgb;
    return ambient.rgb * min(textureLod(u_sky, n, u_sky_blur).rgb / max(above, vec3(1e-4)), vec3(4.0));
}

// Mirror-like light of the sky on a rough surface.
vec3 sky_specular(vec3 n, vec3 v, float f0, float alpha) {
    if (u_sky_blur < 0.0 || f0 <= 0.0) {
        return vec3(0.0);
    }
    vec3 r = reflect(-v, n);
    float lod = (u_sky_blur + u_sky_left_out) * sqrt(sqrt(alpha)) - u_sky_left_out;
    return textureLod(u_sky, r, lod).rgb * environment_reflectance(f0, dot(n, v), alpha);
}

uniform float u_refracting; // 1 in the refraction view: alpha is the packed depth

struct Surface {
    vec3 position;   // metres, world
    vec3 normal;     // unit, as shaded
    vec3 geometric;  // unit, of the triangle's side that is seen
    vec3 albedo;     // linear
    float f0;        // specular reflectance at normal incidence
    float alpha;     // GGX roughness
    float translucency; // share of the light from behind that comes through
};

// An opaque surface without shine; the rest is for who knows more of it.
Surface matte_surface(vec3 position, vec3 normal, vec3 geometric, vec3 albedo) {
    return Surface(position, normal, geometric, albedo, 0.0, 1.0, 0.0);
}

// Linear radiance towards the eye, before haze. Under water the sun is dimmed and gathered by the waves.
vec3 shade(Surface s) {
    vec3 to_eye = eye.xyz - s.position;
    float distance_m = length(to_eye);
    vec3 v = distance_m > 1e-6 ? to_eye / distance_m : s.normal;
    float depth = water.w - s.position.y;
    bool submerged = depth > 0.0;
    // The ray is steeper in the water, and the flux through its surface is spread accordingly.
    vec3 l = submerged ? u_sun_refracted : sun_direction.xyz;

    float facing = dot(s.geometric, l);
    vec3 sun = vec3(0.0);   // as it arrives
    vec3 above = vec3(0.0); // as it would without the water
    float front = max(dot(s.normal, l), 0.0) * smoothstep(-0.05, 0.1, facing);
    float through = s.translucency * max(-dot(s.normal, l), 0.0);
    if (front + through > 0.0) {
        sun = sun_radiance.rgb * sun_visibility(s.position, s.geometric * (facing < 0.0 ? -1.0 : 1.0), distance_m);
        above = sun;
        if (submerged) {
            sun *= sun_through_water(depth) * caustics(s.position, depth);
            // Deeper, what the bright floor and the surface throw at each other makes up for it.
            float spread = clamp(sun_direction.y / max(u_sun_refracted.y, 0.2), 0.0, 1.0);
            sun *= mix(spread, 1.0, smoothstep(0.05, 0.8, depth));
        }
    }
    // Light that came through a leaf is yellower than the light that it reflects.
    vec3 transmitted = s.albedo * vec3(1.35, 1.15, 0.35);
    vec3 sky = sky_ambient(s.normal);
    vec3 behind = s.translucency > 0.0 ? sky_ambient(-s.normal) * s.translucency * 0.5 : vec3(0.0);
    if (submerged) {
        sky *= exp(-min(water.rgb * depth * 1.2, vec3(60.0)));
    }
    vec3 color = (s.albedo * front + transmitted * through) * (1.0 / PI) * sun + s.albedo * sky + transmitted * behind;
    // Under water nothing shines; at its very edge the shine passes softly from the sand to the water.
    float dry = submerged ? (1.0 - smoothstep(0.03, 0.10, depth)) * (1.0 - u_refracting) : 1.0;
    if (s.f0 > 0.0 && dry > 0.0) {
        color += dry * above * specular_ggx(s.normal, v, sun_direction.xyz, s.f0, s.alpha, 16.0);
        color += dry * sky_specular(s.normal, v, s.f0, s.alpha);
    }
    return color;
}
