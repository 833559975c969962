#include "scene/camera.hpp"

#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>

namespace paradize {

void finish_view(View &view) {
    view.view_projection = view.projection * view.view;
    // Gribb and Hartmann, "Fast Extraction of Viewing Frustum Planes from the World-View-Projection Matrix",
    // 2001.
    const glm::mat4 rows = glm::transpose(view.view_projection);
    for (int axis = 0; axis < 3; ++axis) {
        view.planes[static_cast<std::size_t>(2 * axis)] = rows[3] + rows[axis];
        view.planes[static_cast<std::size_t>(2 * axis + 1)] = rows[3] - rows[axis];
    }
    for (glm::vec4 &plane : view.planes) {
        plane /= std::max(glm::length(glm::vec3(plane)), 1e-20F);
    }
}

glm::dvec3 anchor_of(const glm::dvec3 &eye) {
    constexpr double near_m = 4096.0; // float32 has a precision of 0.5 mm there
    constexpr double step_m = 1024.0;
    glm::dvec3 out(0.0);
    for (int axis = 0; axis < 3; ++axis) {
        out[axis] = std::abs(eye[axis]) > near_m ? std::round(eye[axis] / step_m) * step_m : 0.0;
    }
    return out;
}

View main_view(const Pose &pose, const assets::Flight &flight, int width_px, int height_px) {
    View out;
    out.kind = ViewKind::main;
    out.width_px = width_px;
    out.height_px = height_px;
    out.near_m = flight.near_m;
    out.far_m = flight.far_m;
    out.anchor = anchor_of(pose.eye);
    out.eye = out.local(pose.eye);
    out.view = view_matrix({pose.eye - out.anchor, pose.target - out.anchor, pose.roll_rad});
    const float aspect = static_cast<float>(width_px) / static_cast<float>(height_px);
    out.projection = glm::perspective(flight.fov_rad, aspect, flight.near_m, flight.far_m);
    out.pixels_at_1m = static_cast<float>(height_px) / (2.0F * std::tan(flight.fov_rad * 0.5F));
    finish_view(out);
    return out;
}

int scaled_px(int px, float scale) {
    return std::max(1, static_cast<int>(std::lround(static_cast<float>(px) * scale)));
}

namespace {

void resize(View &view, float scale) {
    view.width_px = scaled_px(view.width_px, scale);
    view.height_px = scaled_px(view.height_px, scale);
    view.pixels_at_1m *= scale;
}

} // namespace

View mirror_view(const View &main, double level_m, float scale) {
    View out = main;
    const auto level = static_cast<float>(level_m - main.anchor.y);
    out.kind = ViewKind::mirror;
    out.mirrored = true;
    out.clipped = true;
    out.clip_plane = glm::vec4(0.0F, 1.0F, 0.0F, clip_margin_m - level);
    out.eye.y = 2.0F * level - main.eye.y;
    glm::mat4 mirror(1.0F);
    mirror[1][1] = -1.0F;
    mirror[3][1] = 2.0F * level;
    out.view = main.view * mirror;
    resize(out, scale);
    finish_view(out);
    return out;
}

View refraction_view(const View &main, double level_m, float scale) {
    View out = main;
    out.kind = ViewKind::refraction;
    out.clipped = true;
    out.clip_plane =
        glm::vec4(0.0F, -1.0F, 0.0F, static_cast<float>(level_m - main.anchor.y) + clip_margin_m);
    resize(out, scale);
    return out;
}

View light_view(const assets::Shadow &shadow, const glm::vec3 &to_sun, const glm::dvec3 &anchor) {
    View out;
    out.anchor = anchor;
    const glm::vec3 center = out.local(shadow.center);
    out.kind = ViewKind::light;
    out.width_px = shadow.size_px;
    out.height_px = shadow.size_px;
    const float half = shadow.extent_m * 0.5F;
    // Covers everything on the square even for a low sun.
    const float reach = shadow.extent_m * 1.5F;
    out.near_m = 0.0F;
    out.far_m = 2.0F * reach;
    out.eye = center + to_sun * reach;
    const glm::vec3 up =
        std::abs(to_sun.y) > 0.999F ? glm::vec3(0.0F, 0.0F, -1.0F) : glm::vec3(0.0F, 1.0F, 0.0F);
    out.view = glm::lookAt(out.eye, center, up);
    out.projection = glm::ortho(-half, half, -half, half, out.near_m, out.far_m);
    out.pixels_at_1m = 0.0F;
    finish_view(out);
    return out;
}

void jitter(View &view, const glm::vec2 &pixels) {
    if (pixels == glm::vec2(0.0F)) {
        return;
    }
    const glm::vec3 clip(2.0F * pixels.x / static_cast<float>(view.width_px),
                         2.0F * pixels.y / static_cast<float>(view.height_px), 0.0F);
    view.projection = glm::translate(glm::mat4(1.0F), clip) * view.projection;
    finish_view(view);
}

std::array<View, view_kinds> frame_views(const assets::SceneFile &file, const RenderSettings &settings,
                                         const Pose &pose, int width_px, int height_px,
                                         const glm::vec3 &to_sun, const glm::vec2 &pixel) {
    std::array<View, view_kinds> views;
    const auto set = [&](const View &view) { views[static_cast<std::size_t>(view.kind)] = view; };
    View main = main_view(pose, file.flight, width_px, height_px);
    resize(main, settings.render_scale);
    jitter(main, pixel);
    const double level_m = file.water ? file.water->level_m : 0.0;
    set(mirror_view(main, level_m, settings.reflection_scale));
    set(refraction_view(main, level_m, settings.refraction_scale));
    main.samples = settings.samples;
    set(main);
    assets::Shadow shadow = file.shadow.value_or(assets::Shadow());
    shadow.size_px = settings.shadow_size_px;
    View light = light_view(shadow, to_sun, main.anchor);
    jitter(light, pixel);
    set(light);
    return views;
}

glm::mat4 texture_from_clip() {
    return glm::scale(glm::translate(glm::mat4(1.0F), glm::vec3(0.5F)), glm::vec3(0.5F));
}

} // namespace paradize
