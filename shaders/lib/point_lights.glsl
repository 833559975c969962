// Lights at a place, as lamps are: those that reach what is drawn. They throw no shadow.
#include "lib/guard.glsl"

// player/gl/light_uniforms.hpp has the same members.
layout(std140) uniform LightUniforms {
    vec4 light_state;     // x number of lights; y strength of what the surface gives off
    vec4 light_place[16]; // xyz in the view's coordinates, m; w range, m
    vec4 light_color[16]; // rgb linear, of a surface one metre away that faces it; w radius, m
};

// The light of one of them at a point.
struct Arriving {
    vec3 direction; // unit, towards the light
    vec3 light;     // of a surface that faces it
    float spread;   // its radius as seen from the point, rad
};

// Falls with the square of the distance, and smoothly to nothing at the end of its range: B. Karis, "Real
// Shading in Unreal Engine 4", 2013.
Arriving light_at(int index, vec3 position) {
    vec3 way = light_place[index].xyz - position;
    float squared = dot(way, way);
    float radius = light_color[index].w;
    float nearest = max(squared, radius * radius);
    float share = squared / (light_place[index].w * light_place[index].w);
    float window = clamp(1.0 - share * share, 0.0, 1.0);
    return Arriving(safe_normalize(way, vec3(0.0, 1.0, 0.0)), light_color[index].rgb * (window * window / nearest),
                    radius * inversesqrt(nearest));
}

// Widens a highlight by the size of the light: Karis 2013.
float widened_alpha(float alpha, float spread) { return clamp(alpha + spread / 3.0, 0.0, 1.0); }
