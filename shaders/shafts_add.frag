// Adds the light that the air scatters to the picture. Of the four nearest texels those at the pixel's depth
// count most: J. Kopf et al., "Joint Bilateral Upsampling", SIGGRAPH 2007.
#include "lib/frame.glsl"
#include "lib/view_depth.glsl"

uniform sampler2D u_picture;   // linear HDR
uniform sampler2D u_depth;     // its window depth
uniform sampler2D u_shafts;    // as shafts_smooth.frag writes it
uniform float u_texels;        // texels of u_shafts per pixel
uniform float u_range_m;       // at which its depth is 1
uniform vec3 u_light_radiance; // of sun or moon

layout(location = 0) out vec4 fragment;

// The light before a surface at `depth`, of the range. texels: of u_shafts, those around the pixel; nearness:
// of each.
float light_before(float depth, vec2 texels[4], float nearness[4]) {
    float sum = 0.0;
    float weights = 0.0;
    for (int i = 0; i < 4; ++i) {
        float w = nearness[i] / (0.01 + abs(texels[i].y - depth));
        sum += w * texels[i].x;
        weights += w;
    }
    return sum / weights;
}

float depth_at(ivec2 pixel) {
    ivec2 last = textureSize(u_depth, 0) - 1;
    return min(view_depth(texelFetch(u_depth, clamp(pixel, ivec2(0), last), 0).r) / u_range_m, 1.0);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 place = gl_FragCoord.xy * u_texels - 0.5;
    vec2 base = floor(place);
    vec2 f = place - base;
    ivec2 last = textureSize(u_shafts, 0) - 1;
    vec2 texels[4];
    float nearness[4];
    for (int i = 0; i < 4; ++i) {
        ivec2 corner = ivec2(i & 1, i >> 1);
        texels[i] = texelFetch(u_shafts, clamp(ivec2(base) + corner, ivec2(0), last), 0).xy;
        vec2 near = mix(1.0 - f, f, vec2(corner));
        nearness[i] = near.x * near.y + 1e-3;
    }
    // A pixel on an edge shows what lies before and behind it, and has the depth of one of both: its
    // neighbours' depths tell of the other.
    float light = 2.0 * light_before(depth_at(pixel), texels, nearness);
    for (int i = 0; i < 4; ++i) {
        ivec2 aside = i < 2 ? ivec2(2 * i - 1, 0) : ivec2(0, 2 * i - 5);
        light += light_before(depth_at(pixel + aside), texels, nearness);
    }
    vec4 color = texelFetch(u_picture, pixel, 0);
    vec3 lit = max(color.rgb + u_light_radiance * (light / 6.0), 0.4 * color.rgb);
    fragment = vec4(lit, color.a);
}
