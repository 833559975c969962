// The sky between two keys of the scene: the clear skies of both, the glow around its light, clouds. Uses no
// FrameUniforms, because the environment is drawn before there is a view.
#include "lib/color.glsl"
#include "lib/guard.glsl"

uniform samplerCube u_sky_before; // linear radiance without discs, stars and clouds
uniform samplerCube u_sky_after;
uniform float u_sky_share; // of u_sky_after
uniform vec4 u_sky_turns;  // cosine and sine of how far each is turned about Y, from north over east
uniform sampler2D u_clouds; // R, G, B: light from the right, the left, above; A: cover
// Widths of the picture per radian; how far it is turned, in widths; 1 / elevation of its upper edge, 1/rad; its
// texels per radian, 0: no clouds
uniform vec4 u_clouds_fit;
uniform vec3 u_cloud_ambient;   // linear radiance around the clouds, where the sky is bright
uniform vec3 u_light_direction; // unit, towards sun or moon
uniform vec3 u_light_radiance;  // colour x intensity, also where it is just below the horizon

vec3 turned(vec3 d, vec2 turn) { return vec3(d.x * turn.x + d.z * turn.y, d.y, d.z * turn.x - d.x * turn.y); }

vec3 clear_sky(vec3 direction) {
    vec3 before = textureLod(u_sky_before, turned(direction, u_sky_turns.xy), 0.0).rgb;
    vec3 after = textureLod(u_sky_after, turned(direction, u_sky_turns.zw), 0.0).rgb;
    return mix(before, after, u_sky_share);
}

// The air's glow close around the light, which is narrower than a texel of the clear sky.
vec3 light_glow(float towards_light) {
    float angle = sqrt(max(2.0 - 2.0 * towards_light, 0.0)); // rad, near the light
    return u_light_radiance * (0.37 * exp(-38.0 * angle) + 0.07 * exp(-11.5 * angle));
}

// Radiance and cover of the clouds. Their light was baked for three directions; weights are the squares of the
// light's parts along them, as for volumes lit from six sides. Clouds between the eye and the light shine at their
// thin edges, by the phase function of L. G. Henyey and J. L. Greenstein, "Diffuse radiation in the galaxy", 1941.
// clear: the sky behind them. At dusk it is darker than the scene's ambient light, and they scatter no more than it has.
vec4 clouds(vec3 direction, vec3 clear, float towards_light, float pixels_per_rad) {
    if (u_clouds_fit.w <= 0.0) {
        return vec4(0.0);
    }
    float across = max(length(direction.xz), 1e-4);
    vec2 away = direction.xz / across;
    float row = atan(direction.y, across) * u_clouds_fit.z;
    vec2 uv = vec2(atan(away.x, -away.y) * u_clouds_fit.x - u_clouds_fit.y, 1.0 - row);
    float lod = log2(u_clouds_fit.w / pixels_per_rad);
    vec4 baked = textureLod(u_clouds, uv, lod);
    float cover = baked.a * clamp(min(row, 1.0 - row) * 200.0, 0.0, 1.0);
    vec3 light = vec3(dot(u_light_direction.xz, vec2(-away.y, away.x)), u_light_direction.y,
                      dot(u_light_direction.xz, away));
    float sides = 0.5 * (baked.r + baked.g);
    float lit = light.x * light.x * (light.x > 0.0 ? baked.r : baked.g) + light.y * light.y * baked.b +
                light.z * light.z * (light.z > 0.0 ? 0.35 * sides : 0.55 * sides + 0.45 * baked.b);
    float phase = 0.4375 / (12.566 * safe_pow(1.5625 - 1.5 * towards_light, 1.5)); // g = 0.75
    float edge = 1.6 * phase * baked.a * (1.0 - baked.a);
    vec3 around = u_cloud_ambient * min(luminance(clear) / max(luminance(u_cloud_ambient), 1e-6), 1.0);
    return vec4(u_light_radiance * (0.62 * lit + edge) + around * (0.6 + 0.8 * baked.b), cover);
}
