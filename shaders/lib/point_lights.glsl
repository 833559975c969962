// Lights at a place, as lamps are: those that reach what is drawn. They throw no shadow.
#include "lib/guard.glsl"

// Macro: LIGHT_SETS, the sets of a block; by default what fits into the 16 KiB that every device has.
#ifndef LIGHT_SETS
#define LIGHT_SETS 31
#endif

// player/gl/light_uniforms.hpp has the same members.
struct LightSet {
    vec4 state;     // x number of lights; y strength of what the surface gives off
    vec4 place[16]; // xyz in the view's coordinates, m; w range, m
    vec4 color[16]; // rgb linear, of a surface one metre away that faces it; w radius, m
};
layout(std140) uniform LightUniforms {
    LightSet light_sets[LIGHT_SETS];
};
int light_set = 0; // the one that shines here: main() sets it

int light_count() { return int(light_sets[light_set].state.x); }

// The light of one of them at a point.
struct Arriving {
    vec3 direction; // unit, towards the light
    vec3 light;     // of a surface that faces it
    float spread;   // its radius as seen from the point, rad
};

// Falls with the square of the distance, and smoothly to nothing at the end of its range: B. Karis, "Real
// Shading in Unreal Engine 4", 2013.
Arriving light_at(int index, vec3 position) {
    vec4 place = light_sets[light_set].place[index]; // range in w
    vec4 color = light_sets[light_set].color[index]; // radius in w
    vec3 way = place.xyz - position;
    float squared = dot(way, way);
    float nearest = max(squared, color.w * color.w);
    float share = squared / (place.w * place.w);
    float window = clamp(1.0 - share * share, 0.0, 1.0);
    return Arriving(safe_normalize(way, vec3(0.0, 1.0, 0.0)), color.rgb * (window * window / nearest),
                    color.w * inversesqrt(nearest));
}

// Widens a highlight by the size of the light: Karis 2013.
float widened_alpha(float alpha, float spread) { return clamp(alpha + spread / 3.0, 0.0, 1.0); }
