// Wings that flap and legs that step, without bones: what is farther than a hinge from the plane x = 0 of the
// mesh turns about the hinge, up and down and forwards and back, the later the farther out it is.
#include "lib/model.glsl"

// Moves a vertex of the mesh, and turns its normal with it. shape: MaterialUniforms.beat. instance_state: phase in radians,
// angles of lift and swing.
void beat_wings(inout vec3 p, inout vec3 normal, vec3 shape) {
    float reach = max(abs(p.x) - shape.x, 0.0);
    float side = p.x < 0.0 ? -1.0 : 1.0;
    float phase = instance_state.x - shape.y * reach + shape.z * p.z;
    float lift = reach > 0.0 ? instance_state.y * sin(phase) : 0.0;
    float swing = reach > 0.0 ? instance_state.z * cos(phase) : 0.0;
    p += vec3(side * reach * (cos(lift) * cos(swing) - 1.0), reach * sin(lift), reach * sin(swing));
    float s = side * sin(lift);
    float c = cos(lift);
    normal = vec3(c * normal.x - s * normal.y, s * normal.x + c * normal.y, normal.z);
}
