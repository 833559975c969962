// The sea's surface: layers of one tileable wave map at different scales and bearings. Layers 0 and 1 run
// in opposite directions, 2 is a wide swell that breaks their repetition. Offsets are wrapped to [0,1) on the CPU in double,
// so that the waves of the seventh day are as steady as those of the first second.
uniform sampler2D u_wave_normal; // signed xy, tangent space
uniform vec4 u_wave_rows[3];     // rows of the 2 x 2 matrix from world xz in metres to UV, one layer each
uniform vec2 u_wave_offsets[3];  // UV

vec2 wave_uv(int layer, vec2 xz) {
    vec4 rows = u_wave_rows[layer];
    return vec2(dot(rows.xy, xz), dot(rows.zw, xz)) + u_wave_offsets[layer];
}

// A map's signed xy (x along u, y against v) turned into world x and z.
vec2 wave_to_world(int layer, vec2 xy) {
    vec4 rows = u_wave_rows[layer];
    vec2 u_axis = rows.xy * inversesqrt(max(dot(rows.xy, rows.xy), 1e-12));
    vec2 v_axis = rows.zw * inversesqrt(max(dot(rows.zw, rows.zw), 1e-12));
    return xy.x * u_axis - xy.y * v_axis;
}

// Horizontal part of the unit normal of one layer, world x and z.
vec2 wave_tilt(int layer, vec2 xz) {
    return wave_to_world(layer, texture(u_wave_normal, wave_uv(layer, xz)).rg);
}

vec3 wave_normal(vec2 tilt) {
    vec2 t = tilt;
    float squared = dot(t, t);
    if (squared > 0.9) {
        t *= sqrt(0.9 / squared);
        squared = 0.9;
    }
    return vec3(t.x, sqrt(1.0 - squared), t.y);
}
