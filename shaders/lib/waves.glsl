// The waves: three layers of one tileable normal map at different scales and bearings. Layers 0 and 1 run in
// opposite directions, layer 2 is a wide swell that hides their repetition. The CPU wraps the offsets to
// [0,1) in double, so that the waves stay smooth after days.
uniform sampler2D u_wave_normal; // signed xy, tangent space
uniform vec4 u_wave_rows[3];     // per layer: rows of the 2 x 2 matrix from world xz in metres to UV
uniform vec2 u_wave_offsets[3];  // UV

vec2 wave_uv(int layer, vec2 xz) {
    vec4 rows = u_wave_rows[layer];
    return vec2(dot(rows.xy, xz), dot(rows.zw, xz)) + u_wave_offsets[layer];
}

// Rotates a map's signed xy (x along u, y against v) to world x and z.
vec2 wave_to_world(int layer, vec2 xy) {
    vec4 rows = u_wave_rows[layer];
    vec2 u_axis = rows.xy * inversesqrt(max(dot(rows.xy, rows.xy), 1e-12));
    vec2 v_axis = rows.zw * inversesqrt(max(dot(rows.zw, rows.zw), 1e-12));
    return xy.x * u_axis - xy.y * v_axis;
}

// Horizontal part (world x and z) of the unit normal of one layer.
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
