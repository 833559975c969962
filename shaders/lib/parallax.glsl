// Parallax mapping, offset-limited: T. Welsh, "Parallax Mapping with Offset Limiting", 2004, in the few-step
// form of M. Premecz, "Iterative Parallax Mapping with Slope Information", CESCG 2006. There is no division
// by the view's z, so at grazing angles the offset stays below `scale` instead of running away.
// view: towards the eye in tangent space (x along the image, y up it); scale, bias: in units of the
// texture's width; returns the UV (top-left origin, so y is turned round) at which the eye meets the relief.
vec2 parallax_uv(sampler2D height, vec2 uv, vec3 view, float scale, float bias) {
    vec2 direction = vec2(view.x, -view.y);
    vec2 result = uv;
    for (int i = 0; i < 2; ++i) {
        float h = (texture(height, result).r - 0.5) * scale + bias;
        vec2 wanted = uv + h * direction;
        result = mix(result, wanted, 0.75);
    }
    return result;
}
