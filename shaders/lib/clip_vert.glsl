// The clip plane of a view: points with dot(plane, position) < 0 are not drawn. The desktop clips
// triangles; ES 300 has no clip distance in its core, so there lib/clip_frag.glsl discards fragments.
uniform vec4 u_clip_plane; // world space; (0,0,0,1) clips nothing

#ifdef GL_ES
out float v_clip_side;
void write_clip(vec3 position) { v_clip_side = dot(u_clip_plane, vec4(position, 1.0)); }
#else
out float gl_ClipDistance[1];
void write_clip(vec3 position) { gl_ClipDistance[0] = dot(u_clip_plane, vec4(position, 1.0)); }
#endif
