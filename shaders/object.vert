#include "lib/guard.glsl"
#include "lib/position.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 tangent;
layout(location = 3) in vec2 uv0;

uniform mat4 u_model; // world from mesh: scale per axis, rotation, translation

out vec3 v_position;
out vec3 v_normal;
out vec4 v_tangent;
out vec2 v_uv;

void main() {
    mat3 model = mat3(u_model);
    vec3 longest = max(max(abs(model[0]), abs(model[1])), abs(model[2]));
    model /= max(max(max(longest.x, longest.y), longest.z), 1e-37);
    v_position = (u_model * vec4(position, 1.0)).xyz;
    // The cofactors are the inverse transpose times the determinant, whose sign is that of a mirrored model.
    mat3 cofactors = mat3(cross(model[1], model[2]), cross(model[2], model[0]), cross(model[0], model[1]));
    float side = dot(model[0], cofactors[0]) < 0.0 ? -1.0 : 1.0;
    v_normal = side * safe_normalize(cofactors * normal, vec3(0.0, 1.0, 0.0));
    v_tangent = vec4(safe_normalize(model * tangent.xyz, vec3(1.0, 0.0, 0.0)), side * tangent.w);
    v_uv = uv0;
    write_position(v_position);
}
