#include "passes/water_pass.hpp"

#include "gl/buffer.hpp"
#include "gl/draw.hpp"
#include "gl/texture.hpp"

#include <epoxy/gl.h>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace paradize {

namespace {

enum Unit : unsigned { unit_reflection, unit_refraction };

constexpr int grid_steps = 24; // quads per edge

/// Returns a grid line's distance from the eye in metres. Lines are dense near the eye; the last one is at
/// `reach_m`.
float grid_line(int index, float reach_m) {
    const float t = 2.0F * static_cast<float>(index) / static_cast<float>(grid_steps) - 1.0F;
    return reach_m * t * t * t;
}

} // namespace

WaterPass::Lit::Lit(const PassSetup &setup, bool point_lights)
    : program(setup.shaders, "water.vert", "water.frag",
              {shadow_define(setup.settings), cascades_define(setup.settings),
               point_lights_define(point_lights), swash_define(setup)}),
      environment(setup, program), half_size(program.location("u_half_size_m")),
      has_textures(program.location("u_has_textures")), distortion(program.location("u_distortion")),
      deep(program.location("u_deep_color")), shallow(program.location("u_shallow_color")),
      shine(program.location("u_specular_smoothness")), wave_length(program.location("u_wave_length_m")),
      fade_distance(program.location("u_fade_distance_m")) {
    program.set_unit("u_reflection", unit_reflection);
    program.set_unit("u_refraction", unit_refraction);
}

WaterPass::WaterPass(const PassSetup &setup)
    : lit_(setup, false), clamped_(gl::make_sampler(gl::Wrap::clamp, gl::Filter::linear)),
      grid_(gl::VertexArray::create()) {
    if (setup.scene.file().water->light_set != 0) {
        by_lights_.emplace(setup, true);
    }
    const float reach_m = 0.69F * setup.scene.file().flight.far_m; // the corners reach the far plane
    std::vector<glm::vec3> points;
    std::vector<std::uint16_t> triangles;
    for (int z = 0; z <= grid_steps; ++z) {
        for (int x = 0; x <= grid_steps; ++x) {
            points.emplace_back(grid_line(x, reach_m), 0.0F, grid_line(z, reach_m));
            if (x == grid_steps || z == grid_steps) {
                continue;
            }
            const int corner = z * (grid_steps + 1) + x;
            for (int offset : {0, grid_steps + 1, 1, 1, grid_steps + 1, grid_steps + 2}) {
                triangles.push_back(static_cast<std::uint16_t>(corner + offset));
            }
        }
    }
    index_count_ = static_cast<int>(triangles.size());
    glBindVertexArray(grid_.name());
    vertices_ = gl::make_buffer(GL_ARRAY_BUFFER, points.size() * sizeof(points[0]), gl::Usage::fixed);
    gl::write_buffer(GL_ARRAY_BUFFER, vertices_, 0, std::as_bytes(std::span(points)));
    gl::attribute_floats(gl::attribute_position, 3, vertices_, sizeof(glm::vec3), 0);
    indices_ =
        gl::make_buffer(GL_ELEMENT_ARRAY_BUFFER, triangles.size() * sizeof(triangles[0]), gl::Usage::fixed);
    gl::write_buffer(GL_ELEMENT_ARRAY_BUFFER, indices_, 0, std::as_bytes(std::span(triangles)));
    glBindVertexArray(0);
}

void WaterPass::draw(const Frame &frame, const View &view) {
    if (view.kind != ViewKind::main) {
        return;
    }
    const assets::SceneFile &file = frame.scene.file();
    const assets::Water &water = *file.water;
    const bool is_lit = by_lights_ && frame.point_lights.lit()[water.light_set] != 0;
    const Lit &lit = is_lit ? *by_lights_ : lit_;
    lit.program.use();
    lit.environment.apply(frame, view);
    if (is_lit) {
        frame.point_lights.bind(water.light_set);
    }
    const gl::Texture *reflection = frame.shared.reflection;
    const gl::Texture *refraction = frame.shared.refraction;
    gl::bind_texture(unit_reflection, GL_TEXTURE_2D, reflection != nullptr ? reflection->name() : 0,
                     clamped_.name());
    gl::bind_texture(unit_refraction, GL_TEXTURE_2D, refraction != nullptr ? refraction->name() : 0,
                     clamped_.name());
    gl::Program::set(lit.has_textures,
                     glm::vec2(reflection != nullptr ? 1.0F : 0.0F, refraction != nullptr ? 1.0F : 0.0F));
    const float half_m = 0.5F * water.size_m;
    gl::Program::set(lit.half_size, half_m);
    // The edge of the sea fades into haze before the far plane or the sea's own border.
    const float far_m = 0.69F * view.far_m;
    gl::Program::set(lit.fade_distance, far_m);
    gl::Program::set(lit.distortion, glm::vec2(water.reflection_distortion, water.refraction_distortion));
    gl::Program::set(lit.deep, water.deep_color);
    gl::Program::set(lit.shallow, water.shallow_color);
    gl::Program::set(lit.shine, glm::vec2(water.specular, water.smoothness));
    gl::Program::set(lit.wave_length, waves_at(water, 0.0).lengths_m);

    glEnable(GL_BLEND);
    glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
    glDisable(GL_CULL_FACE);
    glBindVertexArray(grid_.name());
    gl::draw_triangles(index_count_, GL_UNSIGNED_SHORT, 0);
    glBindVertexArray(0);
    glEnable(GL_CULL_FACE);
    glBlendFunc(GL_ONE, GL_ZERO);
    glDisable(GL_BLEND);
}

} // namespace paradize
