#include "sea_probe.hpp"

#include "gl/buffer.hpp"
#include "gl/light_uniforms.hpp"
#include "gl/texture.hpp"

#include <epoxy/gl.h>
#include <glm/mat4x4.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace paradize::test {

namespace {

const std::string line_vertex = "#include \"lib/fullscreen.glsl\"\n"
                                "uniform vec2 u_first;\nuniform vec2 u_last;\nout vec3 v_position;\n"
                                "void main() {\nvec2 corner = fullscreen_corner(gl_VertexID);\n"
                                "vec2 xz = mix(u_first, u_last, 0.5 + 0.5 * corner.x);\n"
                                "v_position = vec3(xz.x, 0.0, xz.y);\n"
                                "gl_Position = vec4(corner, 0.0, 1.0); }\n";

const std::string ray_vertex = "#include \"lib/fullscreen.glsl\"\n"
                               "uniform vec3 u_ray;\nout vec3 v_ray;\nvoid main() { v_ray = u_ray;\n"
                               "gl_Position = vec4(fullscreen_corner(gl_VertexID), 0.0, 1.0); }\n";

} // namespace

SeaProbe::SeaProbe(std::initializer_list<std::string_view> defines)
    : frame(plain_frame(places)), probe_(places, line_vertex, "water.frag", defines),
      no_shadow_(gl::make_depth_comparison_layers(1, 1)) {
    frame.water.w = 0.0F;
}

gl::Texture SeaProbe::one_sky(const glm::vec3 &radiance) {
    return float_cube(2, [&](const glm::vec3 &) { return radiance; });
}

std::vector<glm::dvec4> SeaProbe::between(const glm::vec2 &first, const glm::vec2 &last) {
    gl::LightUniforms set{};
    set.state = {static_cast<float>(lamps.size()), 1.0F, 0.0F, 0.0F};
    for (std::size_t i = 0; i < lamps.size(); ++i) {
        set.place[i] = {lamps[i].place_m, 1e7F};
        set.color[i] = {lamps[i].light, lamps[i].radius_m};
    }
    constexpr std::size_t most_sets = 31;
    if (!lights_) {
        lights_ = gl::make_buffer(GL_UNIFORM_BUFFER, most_sets * sizeof(set), gl::Usage::streamed);
    }
    gl::write_buffer(GL_UNIFORM_BUFFER, lights_, 0, std::as_bytes(std::span(&set, 1)));
    glBindBufferBase(GL_UNIFORM_BUFFER, gl::light_uniforms_binding, lights_.name());
    if (in_shade) { // all of a map of one texel is nearer to the sun
        frame.sun_radiance.w = 1.0F;
        frame.shadow_from_world = glm::mat4(0.0F);
        frame.shadow_from_world[3] = {0.5F, 0.5F, 0.5F, 1.0F};
        const float depth = 0.0F;
        glBindTexture(GL_TEXTURE_2D_ARRAY, no_shadow_.name());
        glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, 1, 1, 1, GL_DEPTH_COMPONENT, GL_FLOAT, &depth);
    }
    probe_.set_frame(frame);
    const gl::Program &program = probe_.use();
    const std::array<float, 12> rows{0.1F, 0, 0, 0.1F, 0.1F, 0, 0, 0.1F, 0.1F, 0, 0, 0.1F};
    const std::array<float, 6> offsets{};
    glUniform4fv(program.location("u_wave_rows"), 3, rows.data());
    glUniform2fv(program.location("u_wave_offsets"), 3, offsets.data());
    const gl::Texture waves = one_color(lean.x, -lean.y, 0.0F, 1.0F),
                      dudv = one_color(shake.x, -shake.y, 0.0F, 1.0F);
    probe_.set_texture("u_wave_normal", 0, GL_TEXTURE_2D, waves);
    probe_.set_texture("u_wave_dudv", 1, GL_TEXTURE_2D, dudv);
    probe_.set_texture("u_reflection", 2, GL_TEXTURE_2D, reflection);
    probe_.set_texture("u_refraction", 3, GL_TEXTURE_2D, refraction);
    probe_.set_texture("u_shadow_map", 4, GL_TEXTURE_2D_ARRAY, no_shadow_);
    probe_.set_texture("u_sky", 5, GL_TEXTURE_CUBE_MAP, sky);
    probe_.set("u_sky_blur", {sky_blur});
    probe_.set("u_sky_trimmed_mips", {2.0F}); // the finest mip
    probe_.set("u_shadow_cascades", {1.0F, 0.0F, 0.0F, 1.0F});
    probe_.set("u_shadow_texel", {1.0F});
    probe_.set("u_shadow_penumbra_m", {0.0F});
    probe_.set("u_shadow_blur_m", {0.0F});
    probe_.set("u_water_glow", {water_glow.x, water_glow.y, water_glow.z});
    probe_.set("u_water_scatter", {scatter_per_m});
    probe_.set("u_has_textures", {has_reflection ? 1.0F : 0.0F, has_refraction ? 1.0F : 0.0F});
    probe_.set("u_distortion", {0.1F, 0.1F});
    probe_.set("u_deep_color", {deep.x, deep.y, deep.z});
    probe_.set("u_shallow_color", {shallow.x, shallow.y, shallow.z});
    probe_.set("u_specular_smoothness", {specular, smoothness});
    probe_.set("u_wave_length_m", {wave_length_m, wave_length_m, wave_length_m});
    probe_.set("u_fade_distance_m", {fade_distance_m});
    probe_.set("u_first", {first.x, first.y});
    probe_.set("u_last", {last.x, last.y});
    probe_.set("u_lamplit", {0.0F, 0.0F, 1e6F, 1e6F});
    probe_.set_int("u_light_set", 0);
    const std::vector<float> pixels = probe_.draw();
    std::vector<glm::dvec4> out;
    for (std::size_t i = 0; i < std::size_t{4} * places; i += 4) {
        out.emplace_back(pixels[i], pixels[i + 1], pixels[i + 2], pixels[i + 3]);
    }
    return out;
}

glm::dvec3 SeaProbe::drawn_sky(const glm::vec3 &direction) {
    if (!sky_probe_) {
        sky_probe_.emplace(1, ray_vertex, "sky.frag");
    }
    ShaderProbe &probe = *sky_probe_;
    gl::FrameUniforms above = frame;
    above.eye.y = 1.0F;
    probe.set_frame(above);
    probe.set_texture("u_sky", 5, GL_TEXTURE_CUBE_MAP, sky);
    probe.set("u_water_glow", {0.0F, 0.0F, 0.0F});
    probe.set("u_water_scatter", {0.0F});
    probe.set("u_ray", {direction.x, direction.y, direction.z});
    const std::vector<float> pixel = probe.draw();
    return {pixel[0], pixel[1], pixel[2]};
}

double fresnel_of_water(double cosine) {
    const double sine = std::sqrt(1.0 - cosine * cosine) / water_index;
    const double below = std::sqrt(1.0 - sine * sine);
    const double along = (cosine - water_index * below) / (cosine + water_index * below);
    const double across = (water_index * cosine - below) / (water_index * cosine + below);
    return 0.5 * (along * along + across * across);
}

} // namespace paradize::test
