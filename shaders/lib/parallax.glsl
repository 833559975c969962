// 0: no parallax; 1, 2: iterations of parallax mapping; more: steps of a ray march.
#ifndef PARALLAX_STEPS
#define PARALLAX_STEPS 2
#endif

// Parallax mapping with offset limiting: T. Welsh, "Parallax Mapping with Offset Limiting", 2004, iterated as
// in M. Premecz, "Iterative Parallax Mapping with Slope Information", CESCG 2006. There is no division by the
// view's z. The tangential part of the view direction is limited to STEEPEST, so that no sample moves by more
// than (scale / 2 + |bias|) * STEEPEST. Gutters are baked for this distance
// (pipeline/paradize/stages/gutter.py has the same number). The limit is needed because interpolated tangent
// frames are not exactly orthonormal.
const float STEEPEST = 1.0;

// Returns the UV where the eye sees the relief. `view` points towards the eye in tangent space, x along the
// image and y up it. `scale` and `bias` are in units of the texture's width. UV has its origin at the top
// left, so y is negated.
vec2 parallax_uv(sampler2D height, vec2 uv, vec3 view, float scale, float bias) {
#if PARALLAX_STEPS == 0
    return uv;
#elif PARALLAX_STEPS > 2
    // Marches along the ray to the first step below the relief, and intersects linearly between the last two
    // heights: N. Tatarchuk, "Dynamic Parallax Occlusion Mapping with Approximate Soft Shadows", I3D 2006.
    // With many steps this is the linear search of N. Policarpo, M. Oliveira, J. Comba, "Real-Time Relief
    // Mapping on Arbitrary Polygonal Surfaces", I3D 2005.
    vec2 direction = vec2(view.x, -view.y) / max(view.z, 1e-3);
    direction *= STEEPEST / max(length(direction), STEEPEST);
    vec2 dx = dFdx(uv);
    vec2 dy = dFdy(uv);
    float z = 0.5 * scale + bias;
    float previous_gap = 0.0; // height of the ray above the relief at the last step
    for (int i = 0; i <= PARALLAX_STEPS; ++i) {
        float next = bias + scale * (0.5 - float(i) / float(PARALLAX_STEPS));
        float surface = (textureGrad(height, uv + next * direction, dx, dy).r - 0.5) * scale + bias;
        float gap = next - surface;
        if (gap <= 0.0) {
            z = mix(z, next, previous_gap / max(previous_gap - gap, 1e-9));
            break;
        }
        z = next;
        previous_gap = gap;
    }
    return uv + z * direction;
#else
    vec2 direction = vec2(view.x, -view.y);
    direction *= STEEPEST / max(length(direction), STEEPEST);
    vec2 result = uv;
    for (int i = 0; i < PARALLAX_STEPS; ++i) {
        float h = (texture(height, result).r - 0.5) * scale + bias;
        vec2 target = uv + h * direction;
        result = mix(result, target, 0.75);
    }
    return result;
#endif
}
