// How the relief is met: 0 not at all, 1 and 2 steps of parallax mapping, more: that many steps along the ray.
#ifndef PARALLAX_STEPS
#define PARALLAX_STEPS 2
#endif

// Parallax mapping, offset-limited: T. Welsh, "Parallax Mapping with Offset Limiting", 2004, in the few-step
// form of M. Premecz, "Iterative Parallax Mapping with Slope Information", CESCG 2006. There is no division
// by the view's z, and the part of the view along the surface is held to STEEPEST, so that no sample is moved
// by more than (scale / 2 + |bias|) * STEEPEST: what the gutters are made for (the same number stands in
// pipeline/paradize/stages/gutter.py). Interpolated frames alone are not quite orthonormal.
const float STEEPEST = 1.0;

// view: towards the eye in tangent space (x along the image, y up it); scale, bias: in units of the
// texture's width; returns the UV (top-left origin, so y is turned round) at which the eye meets the relief.
vec2 parallax_uv(sampler2D height, vec2 uv, vec3 view, float scale, float bias) {
#if PARALLAX_STEPS == 0
    return uv;
#elif PARALLAX_STEPS > 2
    // The ray is followed from the relief's top to the first step below it, and the straight line between the
    // last two heights says where it went in: N. Tatarchuk, "Dynamic Parallax Occlusion Mapping with Approximate
    // Soft Shadows", I3D 2006; the brute force of N. Policarpo, M. Oliveira, J. Comba, "Real-Time Relief Mapping
    // on Arbitrary Polygonal Surfaces", I3D 2005, where the steps are many.
    vec2 direction = vec2(view.x, -view.y) / max(view.z, 1e-3);
    direction *= STEEPEST / max(length(direction), STEEPEST);
    vec2 dx = dFdx(uv);
    vec2 dy = dFdy(uv);
    float z = 0.5 * scale + bias;
    float above = 0.0; // of the ray over the relief, at the last step
    for (int i = 0; i <= PARALLAX_STEPS; ++i) {
        float next = bias + scale * (0.5 - float(i) / float(PARALLAX_STEPS));
        float relief = (textureGrad(height, uv + next * direction, dx, dy).r - 0.5) * scale + bias;
        float over = next - relief;
        if (over <= 0.0) {
            z = mix(z, next, above / max(above - over, 1e-9));
            break;
        }
        z = next;
        above = over;
    }
    return uv + z * direction;
#else
    vec2 direction = vec2(view.x, -view.y);
    direction *= STEEPEST / max(length(direction), STEEPEST);
    vec2 result = uv;
    for (int i = 0; i < PARALLAX_STEPS; ++i) {
        float h = (texture(height, result).r - 0.5) * scale + bias;
        vec2 wanted = uv + h * direction;
        result = mix(result, wanted, 0.75);
    }
    return result;
#endif
}
