// Spreads the glow along x or y. A shader of its own: software rasterisers compute both sides of a branch.
uniform sampler2D u_source;
uniform vec2 u_blur_step; // one texel of the source along x or y, UV

in vec2 v_uv;

layout(location = 0) out vec4 fragment;

void main() {
    vec3 sum = vec3(0.0);
    float weights = 0.0;
    for (int i = -6; i <= 6; ++i) {
        float w = exp(-0.07 * float(i * i));
        sum += w * texture(u_source, v_uv + float(i) * u_blur_step).rgb;
        weights += w;
    }
    fragment = vec4(sum / weights, 1.0);
}
