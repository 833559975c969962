#include "passes/frame.hpp"

#include "gl/buffer.hpp"
#include "gl/draw.hpp"
#include "gl/frame_uniforms.hpp"
#include "gl/framebuffer.hpp"
#include "gl/program.hpp"
#include "passes/pass.hpp"
#include "scene/camera.hpp"
#include "scene/flight.hpp"
#include "scene/wind.hpp"

#include <epoxy/gl.h>
#include <glm/matrix.hpp>

namespace paradize {

namespace {

// Enough slots that the driver never waits for one that an earlier frame still reads.
constexpr int uniform_slots = 24;
constexpr float level_without_water = -1e9F;

} // namespace

Frame::Frame(Scene &drawn_scene, std::span<const std::unique_ptr<Pass>> passes)
    : scene(drawn_scene), point_lights(drawn_scene.file()), moving_(drawn_scene),
      transforms_(drawn_scene.objects()), passes_(passes) {
    slot_bytes_ = gl::aligned_uniform_bytes(sizeof(gl::FrameUniforms));
    uniforms_ = gl::Buffer::create();
    glBindBuffer(GL_UNIFORM_BUFFER, uniforms_.name());
    glBufferData(GL_UNIFORM_BUFFER, static_cast<GLsizeiptr>(slot_bytes_ * uniform_slots), nullptr,
                 GL_DYNAMIC_DRAW);
    empty_vertex_array_ = gl::VertexArray::create();
    if (gl::has_indirect_draws()) {
        instances_ = gl::make_buffer(GL_ARRAY_BUFFER, sizeof(InstanceRows), gl::Usage::streamed);
    }
    if (const assets::SceneFile &file = scene.file(); file.terrain) {
        terrain_ = std::make_unique<TerrainTiles>(*file.terrain, scene.streamer());
        if (file.water) {
            terrain_->set_water(*file.water);
        }
    }
    for (std::vector<DrawItem> &items : visible_) {
        items.reserve(scene.instance_count());
    }
}

Frame::~Frame() = default;

float Frame::water_m() const {
    const assets::SceneFile &file = scene.file();
    const double level_m = file.water ? file.water->level_m : level_without_water;
    return static_cast<float>(level_m - view(ViewKind::main).anchor.y);
}

bool Frame::hides_under_water(const View &view) const {
    return view.kind == ViewKind::mirror || (view.kind == ViewKind::main && shared.refraction != nullptr &&
                                             scene.file().water && view.eye.y > water_m());
}

void Frame::move_to(double elapsed_s) {
    moving_.move(flight_second(elapsed_s, scene.file().flight.duration_s));
    const bool all = transforms_.update(view(ViewKind::main).anchor);
    if (!instances_) {
        return;
    }
    const std::span<const InstanceRows> rows = transforms_.rows();
    if (all) {
        gl::replace_buffer(GL_ARRAY_BUFFER, instances_, std::as_bytes(rows));
        return;
    }
    for (const Object &object : scene.objects()) {
        if (object.moves()) {
            const std::uint32_t first = transforms_.first_of(object);
            gl::write_buffer(GL_ARRAY_BUFFER, instances_, first * sizeof(InstanceRows),
                             std::as_bytes(rows.subspan(first, object.instances.size())));
        }
    }
}

void Frame::cull_casters(const View &light) {
    const View &main = view(ViewKind::main);
    std::vector<DrawItem> &casters = visible_[static_cast<std::size_t>(ViewKind::light)];
    casters.clear();
    scene.collect(light, main.eye, main.pixels_at_1m, settings.lod_error_px, casters);
}

void Frame::draw_view(const View &view, unsigned framebuffer, bool depth_only, std::optional<double> wind_s) {
    const assets::SceneFile &file = scene.file();
    gl::FrameUniforms block;
    block.view_projection = view.view_projection;
    block.view = view.view;
    block.inverse_view_projection = glm::inverse(view.view_projection);
    block.shadow_from_world =
        file.shadow ? texture_from_clip() * this->view(ViewKind::light).view_projection : glm::mat4(1.0F);
    block.eye = glm::vec4(view.eye, 1.0F);
    block.clip_plane = view.clip_plane;
    const auto width = static_cast<float>(view.width_px);
    const auto height = static_cast<float>(view.height_px);
    block.viewport = glm::vec4(width, height, 1.0F / width, 1.0F / height);
    block.lens = glm::vec4(view.near_m, view.far_m, view.pixels_at_1m, view.mirrored ? 1.0F : 0.0F);
    block.sun_direction = glm::vec4(daylight.to_light, daylight.angular_radius_rad);
    block.sun_radiance = glm::vec4(daylight.radiance, shared.shadow_map != nullptr ? 1.0F : 0.0F);
    block.ambient = glm::vec4(daylight.ambient, settings.footprint);
    block.fog = glm::vec4(daylight.fog, daylight.fog_density_per_m);
    block.daylight = glm::vec4(daylight.night, daylight.haze_glow, 0.0F, 0.0F);
    block.water = glm::vec4(file.water ? file.water->absorption_per_m : glm::vec3(0.0F), water_m());
    block.anchor = glm::vec4(view.anchor, 0.0);
    if (file.wind) {
        const WindNow wind =
            wind_now(*file.wind, file.flight.duration_s, wind_s.value_or(clock.elapsed_s), view.anchor);
        block.wind = wind.direction;
        block.wind_phases = wind.phases;
    }
    block.clock = glm::vec4(static_cast<float>(clock.flight_s), static_cast<float>(clock.elapsed_s),
                            daylight.exposure, static_cast<float>(clock.frame % 4096));

    slot_ = (slot_ + 1) % uniform_slots;
    const auto offset = static_cast<GLintptr>(slot_bytes_ * static_cast<std::size_t>(slot_));
    glBindBuffer(GL_UNIFORM_BUFFER, uniforms_.name());
    glBufferSubData(GL_UNIFORM_BUFFER, offset, sizeof block, &block);
    glBindBufferRange(GL_UNIFORM_BUFFER, gl::frame_uniforms_binding, uniforms_.name(), offset, sizeof block);

    gl::bind_framebuffer(framebuffer, view.width_px, view.height_px);
    glFrontFace(view.mirrored ? GL_CW : GL_CCW);
    if (view.clipped) {
        glEnable(GL_CLIP_DISTANCE0);
    }
    glClearColor(0.0F, 0.0F, 0.0F, 0.0F);
    glClear(depth_only ? GL_DEPTH_BUFFER_BIT : GL_DEPTH_BUFFER_BIT | GL_COLOR_BUFFER_BIT);
    PassMeter *const measured = view.kind == ViewKind::main ? meter : nullptr;
    if (measured != nullptr) {
        measured->stop(measured->clear());
    }
    for (std::size_t i = 0; i < passes_.size(); ++i) {
        passes_[i]->draw(*this, view);
        if (measured != nullptr) {
            measured->stop(i);
        }
    }
    glDisable(GL_CLIP_DISTANCE0);
    glFrontFace(GL_CCW);
}

void Frame::draw_fullscreen() const {
    glBindVertexArray(empty_vertex_array_.name());
    gl::draw_vertices(GL_TRIANGLES, 3);
}

} // namespace paradize
