// Moon and stars.
#include "lib/guard.glsl"
#include "lib/hash.glsl"

const int STAR_CELLS = 46; // along an edge of each face of a cube; a star in each

// Radiance of the stars in a direction of their own sphere. Fluxes are spread so that the number of stars
// brighter than F falls as F^-1.25, half an order of magnitude for each magnitude: C. W. Allen, "Astrophysical
// Quantities", 1973, section 117. Colours run from those of warm to those of hot stars: H. W. Jensen et al., "A
// Physically-Based Night Sky Model", SIGGRAPH 2001. A star is never narrower than a pixel, so that none flickers
// as the camera turns.
vec3 stars(vec3 direction, float pixels_per_rad) {
    vec3 size = abs(direction);
    int face = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
    float along = face == 0 ? direction.x : (face == 1 ? direction.y : direction.z);
    vec2 across = face == 0 ? direction.yz : (face == 1 ? direction.zx : direction.xy);
    float half_cells = 0.5 * float(STAR_CELLS);
    vec2 place = (across / max(abs(along), 1e-4) + 1.0) * half_cells;
    ivec2 cell = ivec2(clamp(floor(place), 0.0, float(STAR_CELLS - 1)));
    int side = along > 0.0 ? face : face + 3;
    uvec2 first = pcg2d(uvec2(cell.x, cell.y + STAR_CELLS * side));
    uvec2 second = pcg2d(first);
    const float scale = 1.0 / 16777216.0;
    vec2 jitter = vec2(first >> 8u) * scale;
    vec2 draw = vec2(second >> 8u) * scale;
    vec2 star = (vec2(cell) + 0.2 + 0.6 * jitter) / half_cells - 1.0;
    float sign_along = along > 0.0 ? 1.0 : -1.0;
    vec3 towards = face == 0   ? vec3(sign_along, star)
                   : face == 1 ? vec3(star.y, sign_along, star.x)
                               : vec3(star, sign_along);
    vec3 off = direction - normalize(towards);
    float radius_px = 0.8;
    float spread = dot(off, off) * pixels_per_rad * pixels_per_rad / (radius_px * radius_px);
    float flux = min(0.008 * pow(max(draw.x, 1e-4), -0.8), 1.0);
    vec3 tint = mix(vec3(1.0, 0.82, 0.64), vec3(0.74, 0.86, 1.15), draw.y);
    return tint * (flux * exp(-min(spread, 60.0)));
}

// Radiance of the moon's disc, and its cover of what is behind. offset: from its centre, in radii, right and up.
// pixel: width of a pixel, in radii. Its sunlit side is the right one, nearly full.
vec4 moon_disc(vec2 offset, float pixel) {
    float r = length(offset);
    float cover = 1.0 - smoothstep(1.0 - pixel, 1.0 + pixel, r);
    vec3 n = vec3(offset, sqrt(max(1.0 - r * r, 0.0)));
    float lit = smoothstep(-0.05, 0.35, dot(n, vec3(0.56, 0.16, 0.81)));
    float seas = smoothstep(0.42, 0.62, value_noise(offset * 1.7 + 5.0) * 0.65 + value_noise(offset * 4.1 + 9.0) * 0.35);
    return vec4(vec3(1.0 - 0.42 * seas) * lit, cover * lit);
}
