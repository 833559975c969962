// The fragment's half of lib/clip_vert.glsl: call it first.
#ifdef GL_ES
in float v_clip_side;
void apply_clip() {
    if (v_clip_side < 0.0) {
        discard;
    }
}
#else
void apply_clip() {}
#endif
