// Averages squares of 4 x 4 texels, in which shafts_march.frag has looked at all its places. Texels of another
// depth count little, so that light does not leak over edges: C. Tomasi, R. Manduchi, "Bilateral Filtering for
// Gray and Color Images", ICCV 1998.
uniform sampler2D u_shafts; // as shafts_march.frag writes it

layout(location = 0) out vec4 fragment;

void main() {
    ivec2 here = ivec2(gl_FragCoord.xy);
    ivec2 last = textureSize(u_shafts, 0) - 1;
    float depth = texelFetch(u_shafts, here, 0).y;
    float sum = 0.0;
    float weights = 0.0;
    for (int y = -2; y < 2; ++y) {
        for (int x = -2; x < 2; ++x) {
            vec2 there = texelFetch(u_shafts, clamp(here + ivec2(x, y), ivec2(0), last), 0).xy;
            float w = 1.0 / (0.01 + abs(there.y - depth));
            sum += w * there.x;
            weights += w;
        }
    }
    fragment = vec4(sum / weights, depth, 0.0, 1.0);
}
