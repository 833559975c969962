// Waves that lift the sea near the eye: points of the surface run in circles, so that crests are sharper than
// troughs: F. J. Gerstner, "Theorie der Wellen", 1802; A. Fournier, W. T. Reeves, "A Simple Model of Ocean
// Waves", SIGGRAPH 1986. Normals by M. Finch, "Effective Water Simulation from Physical Models", GPU Gems, 2004.
// player/scene/near_waves.hpp describes waves and shares.
uniform vec4 u_near_waves[4];
uniform sampler2D u_wave_shares;
uniform vec4 u_share_of_xz; // xz to the share map: factor, offset

const float FADE_LENGTHS = 2.0; // of a wave, from the eye to where it has faded out

struct LiftedPoint {
    vec3 offset; // m
    vec2 tilt;   // horizontal part of the unit normal
};

LiftedPoint lifted_point(vec2 xz) {
    vec2 place = xz * u_share_of_xz.xy + u_share_of_xz.zw;
    float share = textureLod(u_wave_shares, clamp(place, 0.0, 1.0), 0.0).r;
    float turns_away = distance(xz, eye.xz) / (6.2831853 * FADE_LENGTHS);
    LiftedPoint p = LiftedPoint(vec3(0.0), vec2(0.0));
    float up = 1.0;
    for (int i = 0; i < 4; ++i) {
        vec4 wave = u_near_waves[i];
        float angle = dot(wave.xy, xz) + wave.z;
        float k = length(wave.xy); // not 0: a wave has a length
        float amplitude = share * wave.w * (1.0 - smoothstep(0.35, 1.0, turns_away * k));
        float rise = sin(angle);
        float run = cos(angle);
        p.offset += amplitude * vec3(wave.x / k * run, rise, wave.y / k * run);
        p.tilt -= amplitude * run * wave.xy;
        up -= amplitude * rise * k;
    }
    p.tilt *= inversesqrt(dot(p.tilt, p.tilt) + up * up);
    return p;
}
