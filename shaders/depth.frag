// Discards transparent texels, so that leaves cast shadows of their own shape.
uniform sampler2D u_color;
uniform float u_alpha_cutoff; // 0: opaque

in vec2 v_uv;

void main() {
    if (u_alpha_cutoff > 0.0 && texture(u_color, v_uv).a < u_alpha_cutoff) {
        discard;
    }
}
