#include "lib/color.glsl"
#include "lib/fog.glsl"
#include "lib/hash.glsl"
#include "lib/light.glsl"

uniform sampler2D u_reflection;
uniform sampler2D u_refraction;
uniform sampler2D u_wave_dudv; // signed xy
uniform vec2 u_textures;       // 1 where reflection, refraction were drawn
uniform vec2 u_shake;          // of reflection and refraction, fractions of the screen
uniform vec3 u_deep_color;
uniform vec3 u_shallow_color;
uniform vec2 u_shine;          // specular, smoothness
uniform vec3 u_wave_length_m;  // of the three layers
uniform float u_fade_m;        // distance at which the sea is lost in haze
uniform float u_swash;         // [0,1): phase of the waves that run up the beach

in vec3 v_position;

layout(location = 0) out vec4 fragment;

const float WATER_F0 = 0.02;
const float WATER_IOR = 1.33;

// The radiance of the sky in a direction, as the mirror would show it.
vec3 sky_in(vec3 direction) {
    vec3 up = vec3(direction.x, max(direction.y, 0.0), direction.z);
    if (u_sky_blur < 0.0) {
        return fog.rgb;
    }
    vec3 color = min(textureLod(u_sky, up, 2.0 - u_sky_left_out).rgb, vec3(8.0));
    return mix(color, haze_color(direction), haze_amount(haze_path(up.y)));
}

vec2 inside(vec2 uv, vec2 texel) { return clamp(uv, texel, 1.0 - texel); }

void main() {
    vec3 to_eye = eye.xyz - v_position;
    float distance_m = max(length(to_eye), 1e-3);
    vec3 v = to_eye / distance_m;
    vec2 xz = v_position.xz;

    // Slopes: each layer fades where its waves become too small to be told apart.
    vec3 near = 1.0 / (1.0 + pow(vec3(distance_m) / (30.0 * u_wave_length_m), vec3(2.0)));
    vec2 fine = wave_tilt(0, xz) * near.x + wave_tilt(1, xz) * near.y;
    vec2 tilt = (fine + 1.4 * wave_tilt(2, xz) * near.z);
    vec3 n = wave_normal(tilt);

    // Seen from below: through the window overhead the sky, around it the water's own glow.
    if (eye_in_water()) {
        vec3 down = -n;
        vec3 through = refract(-v, down, WATER_IOR);
        vec3 color = u_water_glow;
        if (dot(through, through) > 0.0) {
            float f = fresnel_schlick(WATER_F0, dot(through, n));
            color = mix(sky_in(through), u_water_glow, f);
        }
        fragment = vec4(apply_haze(color, v_position), 1.0);
        return;
    }

    // Waves hide their own backs: a slope turned away is seen the less the flatter one looks.
    float calm = max(v.y, 1e-3);
    float turn = dot(n, v) / calm;
    float n_v = clamp(calm * (turn < 1.0 ? 1.0 / (2.0 - turn) : turn), 0.0, 1.0);
    vec2 texel = viewport.zw;
    vec2 screen = gl_FragCoord.xy * viewport.zw;

    // The du/dv map, two layers running against one another, shakes both pictures. A slope turns a mirrored
    // ray up or down by twice its angle, but sideways the less the flatter it comes.
    vec2 shake = wave_to_world(0, texture(u_wave_dudv, wave_uv(0, xz)).rg) * near.x +
                 wave_to_world(1, texture(u_wave_dudv, wave_uv(1, xz)).rg) * near.y;
    vec2 right = vec2(view[0][0], view[2][0]);
    vec2 ahead = -v.xz * inversesqrt(max(dot(v.xz, v.xz), 1e-4));
    vec2 turned = vec2(dot(shake, right) * (0.25 + 0.75 * n_v), dot(shake, ahead));

    vec3 reflection;
    if (u_textures.x > 0.5) {
        reflection = texture(u_reflection, inside(screen + turned * u_shake.x, texel)).rgb;
    } else {
        reflection = sky_in(reflect(-v, n));
    }
    // Far out the slopes that face the eye, too small to be drawn, mirror a higher and bluer sky and are less
    // of a mirror: E. Bruneton, F. Neyret, N. Holzschuch, "Real-time Realistic Ocean Lighting", EG 2010.
    float rough = 1.0 - near.x * near.y;
    rough *= rough;
    if (rough > 0.01) {
        vec3 lifted = safe_normalize(vec3(-v.x, abs(v.y) + 0.55, -v.z), vec3(0.0, 1.0, 0.0));
        reflection = mix(reflection, sky_in(lifted), rough);
    }

    // The floor: the shaken sample, unless it shows what stands out of the water.
    vec4 floor_straight = vec4(0.0);
    vec4 floor_seen = vec4(0.0);
    if (u_textures.y > 0.5) {
        floor_straight = texture(u_refraction, screen);
        float depth_here = unpack_depth(floor_straight.a);
        float room = clamp(depth_here * 0.8, 0.0, 1.0) / (1.0 + 0.03 * distance_m);
        vec2 bent = vec2(turned.x, -turned.y) * (room * u_shake.y);
        floor_seen = texture(u_refraction, inside(screen + bent, texel));
        // Nor the gap beside the shore, where nothing was drawn: it looks far deeper than the floor here.
        float usable = smoothstep(0.0, 0.08, unpack_depth(floor_seen.a)) *
                       smoothstep(0.35, 0.6, floor_seen.a / max(floor_straight.a, 1e-3));
        floor_seen = mix(floor_straight, floor_seen, usable);
    }
    float depth = max(unpack_depth(floor_seen.a), 0.0);
    float depth_straight = unpack_depth(floor_straight.a);

    // Water over the floor takes light away colour by colour and gives back its own.
    float slant = sqrt(1.0 - (1.0 - n_v * n_v) / (WATER_IOR * WATER_IOR));
    float path = depth / max(slant, 0.3);
    vec3 kept = exp(-min((water.rgb + u_water_scatter) * path, vec3(60.0)));
    float visibility = sun_visibility(v_position, vec3(0.0, 1.0, 0.0), distance_m);
    vec3 light = sun_radiance.rgb * max(sun_direction.y, 0.0) * (0.35 + 0.65 * visibility) * (1.0 / PI) +
                 sky_ambient(vec3(0.0, 1.0, 0.0));
    float murk = depth * dot(water.rgb, vec3(1.0 / 3.0));
    vec3 own = mix(u_shallow_color, u_deep_color, 1.0 - exp(-min(murk * murk, 60.0))) * light;
    // Crests towards the sun let light through.
    own *= 1.0 + 0.6 * clamp(dot(tilt, sun_direction.xz), -0.5, 0.5);
    vec3 body = floor_seen.rgb * kept + own * (1.0 - kept);

    float fresnel = fresnel_schlick(WATER_F0, mix(n_v, max(n_v, 0.30), rough));
    vec3 color = mix(body, reflection, fresnel);

    // The sun's glitter. Waves too small to see widen its lobe instead of shimmering.
    vec2 lost = vec2(1.0) - near.xy;
    float alpha = max(alpha_of_smoothness(u_shine.y), 0.03);
    alpha = sqrt(clamp(alpha * alpha + 0.012 * (lost.x + lost.y), 0.0, 1.0));
    alpha = filtered_alpha(n, alpha);
    color += sun_radiance.rgb * visibility *
             specular_ggx(n, v, sun_direction.xyz, WATER_F0 * u_shine.x, alpha, 60.0);

    // Foam where the sea runs out, in a broken line that breathes with the swash. Without a floor to see, and
    // where it is deep, the water is simply there.
    float opaque = 1.0;
    if (u_textures.y > 0.5 && depth_straight < 0.2) {
        vec2 world = xz + anchor.xz;
        float ragged = value_noise(world * 1.1 + 3.0 * fine) * 0.6 + value_noise(world * 3.7 - 5.0 * fine) * 0.4;
        float swash = 0.5 + 0.5 * sin(6.2831853 * (u_swash + value_noise(world * 0.06)));
        // The water runs up and back by a hand's breadth of depth, unevenly, so that its edge follows no triangle.
        float lap = depth_straight - 0.012 - 0.02 * (1.0 - swash) - 0.022 * ragged;
        float reach = 0.015 + 0.03 * swash;
        float lace = smoothstep(0.3, 0.75, ragged);
        float foam = smoothstep(0.0, 0.008, lap) * (1.0 - smoothstep(reach, reach + 0.02, lap)) * lace;
        foam *= 0.55 / (1.0 + 0.0004 * distance_m * distance_m);
        color = mix(color, vec3(0.8) * light, foam);
        // A soft edge upon the sand.
        opaque = clamp(max(smoothstep(0.0, 0.05, lap), foam), 0.0, 1.0);
    }

    color = apply_haze(color, v_position);
    // Spray thickens the haze with distance, so that the horizon is nowhere a line.
    vec3 spray = haze_amount(1.8 * distance_m * distance_m * fog.w);
    vec3 lost_in_haze = max(spray, smoothstep(0.55 * u_fade_m, 0.95 * u_fade_m, distance_m));
    // An eye close to the surface looks so flat that all of that happens within a row of pixels: there the
    // haze follows the angle.
    lost_in_haze = max(lost_in_haze, vec3(exp(-abs(v.y) / 0.008) * smoothstep(30.0, 150.0, distance_m)));
    color = mix(color, haze_color(-v), lost_in_haze);
    fragment = vec4(color, opaque);
}
