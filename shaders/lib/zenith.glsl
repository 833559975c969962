// Radiance of the sky straight above, blurred. It is the same all over a view, so vertex shaders look it up, and what they
// draw does not in each pixel.
uniform samplerCube u_sky; // linear radiance
uniform float u_sky_blur;  // mip level that approximates irradiance / pi; below 0: no sky

vec3 sky_zenith() { return textureLod(u_sky, vec3(0.0, 1.0, 0.0), u_sky_blur).rgb; }
