#include "passes/beams_pass.hpp"

#include "gl/buffer.hpp"
#include "gl/draw.hpp"

#include <epoxy/gl.h>
#include <glm/vec3.hpp>

#include <span>

namespace paradize {

namespace {

constexpr std::size_t floats_per_beam = 7;

} // namespace

BeamsPass::BeamsPass(const PassSetup &setup)
    : program_(setup.shaders, "beam.vert", "beam.frag"), environment_(setup, program_),
      strips_(gl::VertexArray::create()) {
    const std::vector<assets::PointLight> &lights = setup.scene.file().lights;
    for (std::uint32_t i = 0; i < lights.size(); ++i) {
        if (lights[i].beam_m > 0.0F) {
            lights_.push_back(i);
        }
    }
    data_.resize(lights_.size() * floats_per_beam);
    constexpr int stride = static_cast<int>(floats_per_beam * sizeof(float));
    glBindVertexArray(strips_.name());
    instances_ = gl::make_buffer(GL_ARRAY_BUFFER, data_.size() * sizeof(float), gl::Usage::streamed);
    gl::attribute_floats(gl::attribute_free, 4, instances_, stride, 0, 1);
    gl::attribute_floats(gl::attribute_free + 1, 3, instances_, stride, 4 * sizeof(float), 1);
    glBindVertexArray(0);
}

void BeamsPass::update(Frame &frame) {
    count_ = 0;
    std::size_t at = 0;
    for (const std::uint32_t index : lights_) {
        const float strength = frame.point_lights.strengths()[index];
        if (strength <= 0.0F) {
            continue;
        }
        const assets::PointLight &light = frame.scene.file().lights[index];
        const glm::vec3 foot = frame.view(ViewKind::main).local(light.position);
        const glm::vec3 color = light.color * (light.intensity * strength);
        for (const float value : {foot.x, foot.y, foot.z, light.beam_m, color.x, color.y, color.z}) {
            data_[at++] = value;
        }
        ++count_;
    }
    if (count_ > 0) {
        gl::write_buffer(GL_ARRAY_BUFFER, instances_, 0, std::as_bytes(std::span(data_).first(at)));
    }
}

void BeamsPass::draw(const Frame &frame, const View &view) {
    if (count_ == 0 || (view.kind != ViewKind::main && view.kind != ViewKind::mirror)) {
        return;
    }
    program_.use();
    environment_.apply(frame, view);
    glBindVertexArray(strips_.name());
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE); // additive
    glDepthMask(GL_FALSE);
    glDisable(GL_CULL_FACE);
    gl::draw_vertices(GL_TRIANGLE_STRIP, 4, static_cast<int>(count_));
    glEnable(GL_CULL_FACE);
    glDepthMask(GL_TRUE);
    glBlendFunc(GL_ONE, GL_ZERO);
    glDisable(GL_BLEND);
    glBindVertexArray(0);
}

} // namespace paradize
