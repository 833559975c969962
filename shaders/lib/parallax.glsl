// Parallax mapping, offset-limited: T. Welsh, "Parallax Mapping with Offset Limiting", 2004, in the few-step
// form of M. Premecz, "Iterative Parallax Mapping with Slope Information", CESCG 2006. There is no division
// by the view's z, and the part of the view along the surface is held to STEEPEST, so that no sample is moved
// by more than (scale / 2 + |bias|) * STEEPEST: what the gutters are made for (the same number stands in
// pipeline/paradize/stages/gutter.py). Interpolated frames alone are not quite orthonormal.
const float STEEPEST = 1.0;

// view: towards the eye in tangent space (x along the image, y up it); scale, bias: in units of the
// texture's width; returns the UV (top-left origin, so y is turned round) at which the eye meets the relief.
vec2 parallax_uv(sampler2D height, vec2 uv, vec3 view, float scale, float bias) {
    vec2 direction = vec2(view.x, -view.y);
    direction *= STEEPEST / max(length(direction), STEEPEST);
    vec2 result = uv;
    for (int i = 0; i < 2; ++i) {
        float h = (texture(height, result).r - 0.5) * scale + bias;
        vec2 wanted = uv + h * direction;
        result = mix(result, wanted, 0.75);
    }
    return result;
}
