#include "lib/guard.glsl"

// Decodes a tangent-space normal from two signed channels (BC5 or RG8 SNORM), which hold zero exactly. z is
// reconstructed. Values outside the unit disc, from block compression, are moved onto it.
vec3 decode_normal(vec2 xy, float strength) {
    vec2 p = xy * strength;
    float squared = dot(p, p);
    if (squared > 0.98) {
        p *= sqrt(0.98 / squared);
        squared = 0.98;
    }
    return vec3(p, sqrt(1.0 - squared));
}

// Tangent space to world space. T and N are interpolated and not normalised, B = w * cross(N, T) points up
// the image; only the result is normalised: M. Mikkelsen, "Simulation of Wrinkled Surfaces Revisited", 2008.
vec3 tangent_to_world(vec3 local, vec3 n, vec4 t) {
    vec3 b = t.w * cross(n, t.xyz);
    return safe_normalize(local.x * t.xyz + local.y * b + local.z * n, safe_normalize(n, vec3(0.0, 1.0, 0.0)));
}

// The tangent, as a vertex has it, that texture coordinates have on the screen; n: unit. C. Schüler, "Normal Mapping
// without Precomputed Tangents", ShaderX5, 2006.
vec4 tangent_on_screen(vec3 position, vec2 uv, vec3 n) {
    vec3 px = dFdx(position), py = dFdy(position);
    vec2 ux = dFdx(uv), uy = dFdy(uv);
    float turned = ux.x * uy.y < ux.y * uy.x ? -1.0 : 1.0;
    vec3 along = turned * (px * uy.y - py * ux.y); // of growing u
    vec3 up = turned * (px * uy.x - py * ux.x);    // of shrinking v
    vec3 t = safe_normalize(along - n * dot(n, along), vec3(1.0, 0.0, 0.0));
    return vec4(t, dot(cross(n, t), up) < 0.0 ? -1.0 : 1.0);
}

// "Whiteout" blending of two tangent-space normals: C. Oat, "Animated Skin/Rain" (ATI, 2006), as compared in
// C. Barre-Brisebois, S. Hill, "Blending in Detail", 2012.
vec3 blend_normals(vec3 a, vec3 b) {
    return safe_normalize(vec3(a.xy + b.xy, a.z * b.z), vec3(0.0, 0.0, 1.0));
}
