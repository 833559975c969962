// The clip plane of a view. Points with dot(plane, position) < 0 are not drawn. Desktop GL uses clip
// distances. ES 300 has none, so lib/clip_frag.glsl discards fragments there.
uniform vec4 u_clip_plane; // in the view's coordinates; (0,0,0,1) clips nothing

#ifdef GL_ES
out float v_clip_side;
void write_clip(vec3 position) { v_clip_side = dot(u_clip_plane, vec4(position, 1.0)); }
#else
out float gl_ClipDistance[1];
void write_clip(vec3 position) { gl_ClipDistance[0] = dot(u_clip_plane, vec4(position, 1.0)); }
#endif
