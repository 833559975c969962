#include "lib/guard.glsl"

// Normal maps are baked as two signed channels (BC5 or RG8 SNORM), so that zero is exact; z is rebuilt.
// xy outside the unit disc (block compression overshoots) is pulled back onto it.
vec3 decode_normal(vec2 xy, float strength) {
    vec2 p = xy * strength;
    float squared = dot(p, p);
    if (squared > 0.98) {
        p *= sqrt(0.98 / squared);
        squared = 0.98;
    }
    return vec3(p, sqrt(1.0 - squared));
}

// Tangent space to world: T and N as interpolated, B = w * cross(N, T) pointing up the image
// (M. Mikkelsen, "Simulation of Wrinkled Surfaces Revisited", 2008: the vectors are not renormalised
// before the sum, only the result is).
vec3 tangent_to_world(vec3 local, vec3 n, vec4 t) {
    vec3 b = t.w * cross(n, t.xyz);
    return safe_normalize(local.x * t.xyz + local.y * b + local.z * n, safe_normalize(n, vec3(0.0, 1.0, 0.0)));
}

// Two tangent-space normals in one: "whiteout" blending, C. Oat, "Animated Skin/Rain" (ATI, 2006) as
// compared in C. Barre-Brisebois, S. Hill, "Blending in Detail", 2012.
vec3 blend_normals(vec3 a, vec3 b) {
    return safe_normalize(vec3(a.xy + b.xy, a.z * b.z), vec3(0.0, 0.0, 1.0));
}
