// The material of an object. player/gl/material_uniforms.hpp has the same members.
layout(std140) uniform MaterialUniforms {
    vec4 base_color;          // linear RGB and opacity, multiplied with the colour map
    vec3 emission_color;      // linear, multiplied with the emission map
    float translucency;       // share of the light from behind that passes through
    vec4 beat;                // hinge in metres; radians per metre that it lags and staggers; 0
    vec2 parallax;            // scale, bias
    vec2 specular_smoothness; // multiplied with the gloss map
    vec2 metalness;           // metalness; 1 if the occlusion map's G multiplies it, else 0
    float occlusion_strength; // 0: none of the occlusion map
    float alpha_cutoff;
    vec2 wind_reach;          // metres that wind moves the object in a full gust: lean, flutter
    float has_color;          // 1: there is a colour map; 0: there is none
    float has_normal;
    float has_height;
    float has_gloss;
    float has_occlusion;
    float has_emission;
    float has_second_normal;  // of the maps on second texture coordinates
    float has_second_gloss;
    float has_second_occlusion; // 2: its G multiplies metalness
    float has_second_emission;
} material;
