// Corner of a triangle that covers the viewport, by gl_VertexID: (-1,-1), (3,-1), (-1,3) in clip space.
vec2 fullscreen_corner(int vertex) {
    return vec2(vertex == 1 ? 3.0 : -1.0, vertex == 2 ? 3.0 : -1.0);
}
