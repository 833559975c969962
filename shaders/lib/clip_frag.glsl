// Fragment part of lib/clip_vert.glsl. Call apply_clip() first in main().
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
