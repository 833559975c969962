// Shared data of view and light. player/gl/frame_uniforms.hpp describes each member. Every view (main,
// mirror, refraction, light) has its own copy with its own eye.
layout(std140) uniform FrameUniforms {
    mat4 view_projection;
    mat4 view;
    mat4 inverse_view_projection;
    mat4 shadow_from_world;
    vec4 eye;
    vec4 clip_plane;
    vec4 viewport;
    vec4 lens;
    vec4 sun_direction;
    vec4 sun_radiance;
    vec4 ambient;
    vec4 fog;
    vec4 water;
    vec4 clock;
    vec4 anchor;
    vec4 wind;
    vec4 wind_phases;
    vec4 daylight;
};
