#include "sky_probe.hpp"

#include <epoxy/gl.h>
#include <glm/gtc/type_ptr.hpp>
#include <glm/mat3x3.hpp>

#include <cstddef>
#include <string>
#include <vector>

namespace paradize::test {

namespace {

const std::string patch_vertex =
    "#include \"lib/fullscreen.glsl\"\n"
    "uniform vec3 u_middle;\nuniform vec3 u_right;\nuniform vec3 u_up;\nout vec3 v_ray;\n"
    "void main() {\nvec2 corner = fullscreen_corner(gl_VertexID);\n"
    "v_ray = u_middle + corner.x * u_right + corner.y * u_up;\n"
    "gl_Position = vec4(corner, 0.0, 1.0); }\n";

} // namespace

DaytimeSky::DaytimeSky(const glm::vec3 &radiance)
    : before(float_cube(2, [&](const glm::vec3 &) { return radiance; })),
      after(float_cube(2, [&](const glm::vec3 &) { return radiance; })), clouds(one_color(0, 0, 0, 0)) {}

void DaytimeSky::apply(ShaderProbe &probe) const {
    const auto set = [&](const char *name, const glm::vec3 &v) { probe.set(name, {v.x, v.y, v.z}); };
    probe.set_texture("u_sky_before", 1, GL_TEXTURE_CUBE_MAP, before);
    probe.set_texture("u_sky_after", 2, GL_TEXTURE_CUBE_MAP, after);
    probe.set_texture("u_clouds", 3, GL_TEXTURE_2D, clouds);
    probe.set("u_sky_share", {share});
    probe.set("u_sky_turns", {turns.x, turns.y, turns.z, turns.w});
    probe.set("u_clouds_fit", {clouds_fit.x, clouds_fit.y, clouds_fit.z, clouds_fit.w});
    set("u_cloud_ambient", cloud_ambient);
    set("u_light_direction", light_direction);
    set("u_light_radiance", light_radiance);
}

SkyPatch::SkyPatch(const std::string &fragment) : probe_(side_px, patch_vertex, fragment, {"NIGHT 1"}) {}

std::vector<glm::dvec3> SkyPatch::around(const glm::vec3 &middle, double pixels_per_rad) {
    const glm::vec3 ahead = glm::normalize(middle);
    const glm::vec3 aside = glm::cross(ahead, glm::vec3(0.0F, 1.0F, 0.0F));
    const glm::vec3 right = glm::length(aside) > 1e-3F ? glm::normalize(aside) : glm::vec3(1.0F, 0.0F, 0.0F);
    const auto half = static_cast<float>(0.5 * side_px / pixels_per_rad);
    const auto set = [&](const char *name, const glm::vec3 &v) { probe_.set(name, {v.x, v.y, v.z}); };
    frame.lens.z = static_cast<float>(pixels_per_rad);
    probe_.set_frame(frame);
    probe_.set_texture("u_sky", 0, GL_TEXTURE_CUBE_MAP, cube);
    day.apply(probe_);
    set("u_middle", ahead);
    set("u_right", right * half);
    set("u_up", glm::cross(right, ahead) * half);
    set("u_sun", sun);
    set("u_moon", moon);
    set("u_water_glow", water_glow);
    probe_.set("u_water_scatter", {0.0F});
    probe_.set("u_sun_disc", {sun_disc.x, sun_disc.y, sun_disc.z, sun_disc.w});
    probe_.set("u_moon_disc", {moon_disc.x, moon_disc.y, moon_disc.z, moon_disc.w});
    probe_.set("u_star_light", {star_light});
    probe_.set("u_star_area", {star_area});
    const glm::mat3 unturned(1.0F);
    glUniformMatrix3fv(probe_.use().location("u_star_turn"), 1, GL_FALSE, glm::value_ptr(unturned));
    const std::vector<float> pixels = probe_.draw();
    std::vector<glm::dvec3> out;
    for (std::size_t i = 0; i < pixels.size(); i += 4) {
        out.emplace_back(pixels[i], pixels[i + 1], pixels[i + 2]);
    }
    return out;
}

glm::dvec3 SkyPatch::in(const glm::vec3 &direction) {
    return around(direction, 1e5)[SkyPatch::side_px * (SkyPatch::side_px + 1) / 2];
}

} // namespace paradize::test
