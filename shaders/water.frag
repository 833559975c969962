// Macros: IN_WATER 1 for an eye below the surface; RIPPLES 1 has ripples run from what stands in the water; SWASH 1 has waves run up the beach; NEAR_WAVES 1 has waves lift the surface; default 0.
#include "lib/color.glsl"
#include "lib/fog.glsl"
#include "lib/hash.glsl"
#include "lib/light.glsl"
#include "lib/specular_antialiasing.glsl"
#include "lib/swash.glsl"

#ifndef RIPPLES
#define RIPPLES 0
#endif
#if RIPPLES
#include "lib/ripples.glsl"
#endif
#ifndef SWASH
#define SWASH 0
#endif
#ifndef IN_WATER
#define IN_WATER 0
#endif
#ifndef NEAR_WAVES
#define NEAR_WAVES 0
#endif

uniform sampler2D u_reflection;
uniform sampler2D u_refraction;
uniform sampler2D u_wave_dudv; // signed xy
uniform vec2 u_has_textures;   // 1 if there is a reflection, a refraction texture
uniform vec2 u_distortion;     // distortion of reflection and refraction by waves, share of the screen
uniform vec3 u_deep_color;
uniform vec3 u_shallow_color;
uniform vec2 u_specular_smoothness; // specular, smoothness
uniform vec3 u_wave_length_m;       // per layer
#if POINT_LIGHTS
uniform int u_light_set;              // in the bound block
uniform vec4 u_lamplit;               // the rectangle that its lights reach: middle and half sides along x and z, m
#endif
uniform float u_fade_distance_m;    // distance at which the sea disappears in haze

in vec3 v_position;
#if NEAR_WAVES
in vec2 v_tilt;
in vec3 v_calm;
#endif

layout(location = 0) out vec4 fragment;

const float WATER_F0 = 0.02;
const float WATER_IOR = 1.33;
const float LIFTED_SHAKE = 4.0; // du/dv of a tilt

// Radiance of the sky in a direction, with the limits of the mirror view.
vec3 sky_radiance(vec3 direction) {
    vec3 up = vec3(direction.x, max(direction.y, 0.0), direction.z);
    if (u_sky_blur < 0.0) {
        return fog.rgb;
    }
    vec3 color = min(textureLod(u_sky, up, 2.0 - u_sky_trimmed_mips).rgb, vec3(8.0));
    return mix(color, haze_color(direction), haze_amount(haze_path(up.y)));
}

vec2 clamp_to_picture(vec2 uv, vec2 texel) { return clamp(uv, texel, 1.0 - texel); }

void main() {
    vec3 to_eye = eye.xyz - v_position;
    float distance_m = max(length(to_eye), 1e-3);
    vec3 v = to_eye / distance_m;
    vec2 xz = v_position.xz;

    // Fades out each layer where its waves become smaller than a pixel.
    vec3 resolved = 1.0 / (1.0 + pow(vec3(distance_m) / (30.0 * u_wave_length_m), vec3(2.0)));
    vec2 fine_tilt = wave_tilt(0, xz) * resolved.x + wave_tilt(1, xz) * resolved.y;
    vec2 tilt = (fine_tilt + 1.4 * wave_tilt(2, xz) * resolved.z);
#if NEAR_WAVES
    tilt += v_tilt;
#endif
#if RIPPLES
    vec2 ripples = ripple_tilt(xz, distance_m);
    tilt += ripples;
#endif
    vec3 n = wave_normal(tilt);

#if IN_WATER
    // The sky inside Snell's window, the water's own radiance around it.
    vec3 refracted = refract(-v, -n, WATER_IOR);
    vec3 color = u_water_glow;
    if (dot(refracted, refracted) > 0.0) {
        float f = fresnel_schlick(WATER_F0, dot(refracted, n));
        color = mix(sky_radiance(refracted), u_water_glow, f);
    }
    fragment = vec4(apply_haze(color, v_position), 1.0);
#else
    // Slopes that face away are hidden by other waves at grazing angles, so they are weighted less.
    float v_up = max(v.y, 1e-3);
    float facing = dot(n, v) / v_up;
    float n_v = clamp(v_up * (facing < 1.0 ? 1.0 / (2.0 - facing) : facing), 0.0, 1.0);
    vec2 texel = viewport.zw;
#if NEAR_WAVES
    // The other views were drawn for the calm surface, so they are looked up where it would be: what stands in
    // the water then meets its mirror image and what is seen of it below at the lifted surface.
    vec2 screen = clamp(0.5 + 0.5 * v_calm.xy / max(v_calm.z, 1e-3), 0.0, 1.0);
#else
    vec2 screen = gl_FragCoord.xy * viewport.zw;
#endif

    // Two opposite layers of the du/dv map distort reflection and refraction. A slope turns a reflected ray
    // vertically by twice its angle, but sideways by less at grazing angles.
    vec2 shake = wave_to_world(0, texture(u_wave_dudv, wave_uv(0, xz)).rg) * resolved.x +
                 wave_to_world(1, texture(u_wave_dudv, wave_uv(1, xz)).rg) * resolved.y;
#if NEAR_WAVES
    shake += LIFTED_SHAKE * v_tilt;
#endif
#if RIPPLES
    shake += LIFTED_SHAKE * ripples;
#endif
    vec2 right = vec2(view[0][0], view[2][0]);
    vec2 ahead = -v.xz * inversesqrt(max(dot(v.xz, v.xz), 1e-4));
    vec2 distortion = vec2(dot(shake, right) * (0.25 + 0.75 * n_v), dot(shake, ahead));

    // Far away, waves smaller than a pixel reflect a higher, bluer part of the sky and reflect less: E.
    // Bruneton, F. Neyret, N. Holzschuch, "Real-time Realistic Ocean Lighting", EG 2010.
    float rough = 1.0 - resolved.x * resolved.y;
    rough *= rough;
    vec3 towards_sky = safe_normalize(vec3(-v.x, abs(v.y) + 0.20, -v.z), vec3(0.0, 1.0, 0.0));
    // Without a reflection texture the sky stands for it. One lookup of the sky serves either.
    bool mirrors = u_has_textures.x > 0.5;
    vec3 sky = sky_radiance(mirrors ? towards_sky : safe_normalize(mix(reflect(-v, n), towards_sky, rough), towards_sky));
    vec3 reflection = texture(u_reflection, clamp_to_picture(screen + distortion * u_distortion.x, texel)).rgb;
    reflection = mirrors ? mix(reflection, sky, rough) : sky;

    // Colour of the floor. The distorted sample is used unless it shows something above the water,
    vec4 floor_undistorted = vec4(0.0);
    vec4 floor_color = vec4(0.0);
    if (u_has_textures.y > 0.5) {
        floor_undistorted = texture(u_refraction, screen);
        float depth_here = unpack_depth(floor_undistorted.a);
        float max_offset = clamp(depth_here * 0.8, 0.0, 1.0) / (1.0 + 0.03 * distance_m);
        vec2 offset = vec2(distortion.x, -distortion.y) * (max_offset * u_distortion.y);
        floor_color = texture(u_refraction, clamp_to_picture(screen + offset, texel));
        // or the gap at the shore where nothing was drawn. The gap looks much deeper than the floor here.
        float usable = smoothstep(0.0, 0.08, unpack_depth(floor_color.a)) *
                       smoothstep(0.35, 0.6, floor_color.a / max(floor_undistorted.a, 1e-3));
        floor_color = mix(floor_undistorted, floor_color, usable);
    }
    float depth = max(unpack_depth(floor_color.a), 0.0);
    float depth_straight = unpack_depth(floor_undistorted.a);

    // Absorption and scattering along the refracted path.
    float slant = sqrt(1.0 - (1.0 - n_v * n_v) / (WATER_IOR * WATER_IOR));
    float path = depth / max(slant, 0.3);
    vec3 transmittance = exp(-min((water.rgb + u_water_scatter) * path, vec3(60.0)));
    float visibility = sun_visibility(v_position, vec3(0.0, 1.0, 0.0), distance_m);
    vec3 light = sun_radiance.rgb * max(sun_direction.y, 0.0) * (0.35 + 0.65 * visibility) * (1.0 / PI) +
                 sky_ambient_up();
    // Waves smaller than a pixel widen the lobe of glitter.
    vec2 unresolved = vec2(1.0) - resolved.xy;
    float alpha = max(alpha_of_smoothness(u_specular_smoothness.y), 0.03);
    alpha = sqrt(clamp(alpha * alpha + 0.012 * (unresolved.x + unresolved.y), 0.0, 1.0));
    alpha = filtered_alpha(n, alpha);
    Reflector surface = dielectric_reflector(WATER_F0 * u_specular_smoothness.x);
    vec3 bounces = multiple_scattering(reflectance_f0(surface), directional_albedo(n_v, alpha));
    vec3 glitter = sun_radiance.rgb * visibility * specular_ggx(n, v, sun_direction.xyz, surface, alpha, 60.0);
#if POINT_LIGHTS
    light_set = u_light_set;
    int lights = all(lessThan(abs(xz - u_lamplit.xy), u_lamplit.zw)) ? light_count() : 0;
    for (int i = 0; i < lights; ++i) {
        Arriving one = light_at(i, v_position);
        light += one.light * (max(one.direction.y, 0.0) * (1.0 / PI));
        glitter += one.light * specular_ggx(n, v, one.direction, surface, widened_alpha(alpha, one.spread), 60.0);
    }
#endif
    float optical_depth = depth * dot(water.rgb, vec3(1.0 / 3.0));
    vec3 scattered = mix(u_shallow_color, u_deep_color, 1.0 - exp(-min(optical_depth * optical_depth, 60.0))) * light;
    // Crests towards the sun transmit light.
    scattered *= 1.0 + 0.6 * daylight.y * clamp(dot(tilt, sun_direction.xz), -0.5, 0.5);
    vec3 below_surface = floor_color.rgb * transmittance + scattered * (1.0 - transmittance);

    float fresnel = fresnel_schlick(WATER_F0, mix(n_v, max(n_v, 0.10), rough));
    vec3 color = mix(below_surface, reflection, fresnel) + bounces * glitter;

    // Foam of waves that break at the shore. Deep water and water without a refraction texture are opaque.
    float opaque = 1.0;
    float pixel_m = sqrt(max(dot(dFdx(xz), dFdx(xz)), dot(dFdy(xz), dFdy(xz))));
    float depth_per_pixel = fwidth(depth_straight);
    // A loop, because software rasterisers leave one out where no pixel needs it, but not a branch.
    int at_shore = u_has_textures.y > 0.5 && depth_straight < 0.4 ? 1 : 0;
    for (int i = 0; i < at_shore; ++i) {
        vec2 world = xz + anchor.xz;
        // Noise hides the terrain's triangles.
        float shore_depth = depth_straight - 0.022 * value_noise(world * 1.1 + 3.0 * fine_tilt);
        // Soft transition to the sand, which draws the waves that run up on it.
        opaque = smoothstep(0.0, 0.05, shore_depth);
#if SWASH
        Swash swash = swash_at(world, -depth_straight, depth_per_pixel, pixel_m);
        color = mix(color, vec3(0.85) * light, swash.foam);
        opaque = max(opaque, swash.foam * smoothstep(-0.005, 0.005, depth_straight));
#endif
    }

    color = apply_haze(color, v_position);
    // Spray thickens the haze with distance, which softens the horizon.
    vec3 spray = haze_amount(1.8 * distance_m * distance_m * fog.w);
    vec3 haze = max(spray, smoothstep(0.55 * u_fade_distance_m, 0.95 * u_fade_distance_m, distance_m));
    // For an eye close to the surface, the transition to the horizon is only a pixel high. The haze follows
    // the view angle there.
    haze = max(haze, vec3(exp(-abs(v.y) / 0.008) * smoothstep(30.0, 150.0, distance_m)));
    color = mix(color, haze_color(-v), haze);
    fragment = vec4(color, opaque);
#endif
}
