// The transform of an instance from its mesh to the view's coordinates: scale along each axis, rotation,
// translation.
// instance_state: xyz the inputs of BEAT, or xy the material's wind_reach, so that one draw of shadows takes many materials;
// w its set of lights.
layout(location = 7) in vec4 model_x; // rows of the matrix
layout(location = 8) in vec4 model_y;
layout(location = 9) in vec4 model_z;
layout(location = 10) in vec4 instance_state;

vec3 from_mesh(vec3 position) {
    vec4 p = vec4(position, 1.0);
    return vec3(dot(model_x, p), dot(model_y, p), dot(model_z, p));
}
