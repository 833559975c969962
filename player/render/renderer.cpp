#include "render/renderer.hpp"

#include "gl/debug.hpp"
#include "gl/draw.hpp"
#include "gl/framebuffer.hpp"
#include "gl/texture.hpp"
#include "scene/camera.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace paradize {

namespace {

std::vector<std::unique_ptr<Pass>> make_passes(std::span<const std::size_t> index, const PassSetup &setup) {
    std::vector<std::unique_ptr<Pass>> passes;
    for (const std::size_t pass : index) {
        passes.push_back(make_pass(pass, setup));
    }
    return passes;
}

void set_default_state() {
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LEQUAL); // the far plane has the sky; layers lie on triangles of other materials
    glDepthMask(GL_TRUE);
    glEnable(GL_CULL_FACE);
    glCullFace(GL_BACK);
    glFrontFace(GL_CCW);
    glDisable(GL_BLEND);
    glDisable(GL_DITHER); // the last pass dithers
    glEnable(GL_TEXTURE_CUBE_MAP_SEAMLESS);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
}

} // namespace

Renderer::Renderer(Scene &scene, const gl::ShaderLibrary &shaders, const RendererOptions &options)
    : scene_(scene), shaders_(shaders), pass_indices_(enabled_passes(scene.file(), options.disabled)),
      passes_(make_passes(pass_indices_, {scene, shaders, options.settings})),
      has_post_(std::ranges::find(options.disabled, "post") == options.disabled.end()), main_(shaders),
      frame_(scene, passes_) {
    frame_.settings = options.settings;
    set_default_state();
    resize(options.width_px, options.height_px);
}

Renderer::~Renderer() = default;

Renderer::Picture Renderer::make_picture() const {
    Picture picture;
    picture.color = gl::make_target(GL_RGBA16F, frame_.width_px, frame_.height_px);
    picture.framebuffer = gl::make_framebuffer(picture.color, {});
    return picture;
}

/// Creates what filters need, where one of the passes filters and nothing is there yet.
void Renderer::make_filter_targets() {
    if (!has_filters() || pictures_[1].framebuffer) {
        return;
    }
    pictures_[1] = make_picture();
    resolved_depth_ = gl::make_target(GL_DEPTH24_STENCIL8, frame_.width_px, frame_.height_px);
    depth_framebuffer_ = gl::make_framebuffer({}, resolved_depth_);
}

void Renderer::make_main() {
    const RenderSettings &settings = frame_.settings;
    main_.make(frame_.width_px, frame_.height_px, settings.samples, has_post_ && settings.fine_edges);
}

void Renderer::resize(int width_px, int height_px) {
    if (width_px == width_px_ && height_px == height_px_) {
        return;
    }
    width_px_ = width_px;
    height_px_ = height_px;
    final_ = gl::make_target(GL_RGBA8, width_px, height_px);
    output_ = gl::make_framebuffer(final_, {});
    frame_.output_width_px = width_px;
    frame_.output_height_px = height_px;
    frame_.output = output_.name();
    cached_passes_.clear(); // their size is wrong now
    make_targets();
}

void Renderer::make_targets() {
    frame_.width_px = scaled_px(width_px_, frame_.settings.render_scale);
    frame_.height_px = scaled_px(height_px_, frame_.settings.render_scale);
    make_main();
    pictures_[0] = make_picture();
    pictures_[1] = {};
    make_filter_targets();
    for (const std::unique_ptr<Pass> &pass : passes_) {
        pass->resize(frame_);
    }
}

void Renderer::change_settings(const RenderSettings &settings) {
    const RenderSettings before = std::exchange(frame_.settings, settings);
    const bool resized = before.render_scale != settings.render_scale;
    for (std::size_t i = 0; i < passes_.size(); ++i) {
        const std::size_t index = pass_indices_[i];
        if (reusable(index, before, settings)) {
            continue;
        }
        std::unique_ptr<Pass> pass;
        const auto cached = std::ranges::find_if(cached_passes_, [&](const CachedPass &kept) {
            return kept.index == index && reusable(index, kept.settings, settings);
        });
        if (cached != cached_passes_.end()) {
            pass = std::move(cached->pass);
            cached_passes_.erase(cached);
        } else {
            pass = make_pass(index, {scene_, shaders_, settings});
        }
        pass->resize(frame_);
        cached_passes_.push_back({index, before, std::exchange(passes_[i], std::move(pass))});
    }
    if (resized) {
        make_targets();
    } else if (before.samples != settings.samples || before.fine_edges != settings.fine_edges) {
        make_main();
    }
    make_filter_targets(); // another quality may filter where the one before did not
}

void Renderer::continue_from(const Renderer &before) {
    frame_.clock = before.frame_.clock;
}

void Renderer::set_views(const Pose &pose, const Sample &sample) {
    const assets::SceneFile &file = scene_.file();
    const RenderSettings &settings = frame_.settings;
    frame_.daylight = daylight_at(file, frame_.clock.flight_s, settings.shadow_steps_per_s);
    glm::vec3 &to_light = frame_.daylight.to_light;
    if (sample.sun != glm::vec2(0.0F)) {
        to_light = sun_direction(to_light, frame_.daylight.angular_radius_rad, sample.sun);
    }
    frame_.views_ = frame_views(file, settings, pose, width_px_, height_px_, to_light, sample.pixel);
    const View &main = frame_.view(ViewKind::main);
    const CpuTimer timer(frame_.scene_ms);
    frame_.move_to(frame_.clock.elapsed_s);
    frame_.point_lights.update({frame_.clock.flight_s, frame_.clock.elapsed_s}, main.anchor);
    if (frame_.terrain_) {
        frame_.terrain_->update(main, settings.lod_error_px);
    }
    for (std::size_t i = 0; i < view_kinds; ++i) {
        const View &view = frame_.views_[i];
        const bool is_light = view.kind == ViewKind::light;
        frame_.visible_[i].clear();
        scene_.collect(view, is_light ? main.eye : view.eye, is_light ? main.pixels_at_1m : view.pixels_at_1m,
                       settings.lod_error_px, frame_.visible_[i]);
    }
}

void Renderer::begin_frame(double elapsed_s) {
    first_draw_call_ = gl::draw_calls();
    frame_.scene_ms = 0.0;
    frame_.clock.elapsed_s = elapsed_s;
    frame_.clock.flight_s = flight_second(elapsed_s, scene_.file().flight.duration_s);
}

bool Renderer::has_filters() const {
    return std::ranges::any_of(passes_, [](const std::unique_ptr<Pass> &pass) { return pass->filters(); });
}

bool Renderer::has_filters_now() const {
    return std::ranges::any_of(
        passes_, [this](const std::unique_ptr<Pass> &pass) { return pass->filters_now(frame_); });
}

/// Runs the passes that filter this frame. The picture alternates between two targets.
void Renderer::filter() {
    for (std::size_t i = 0; i < passes_.size(); ++i) {
        if (!passes_[i]->filters_now(frame_)) {
            continue;
        }
        frame_.filtered = pictures_[1 - picture_].framebuffer.name();
        passes_[i]->filter(frame_);
        picture_ = 1 - picture_;
        frame_.shared.picture = &pictures_[picture_].color;
        if (frame_.meter != nullptr) {
            frame_.meter->stop(i);
        }
    }
}

/// Calls a function of all passes and measures each.
void Renderer::for_each_pass(void (Pass::*call)(Frame &)) {
    for (std::size_t i = 0; i < passes_.size(); ++i) {
        (passes_[i].get()->*call)(frame_);
        if (frame_.meter != nullptr) {
            frame_.meter->stop(i);
        }
    }
}

/// Draws, resolves and filters the linear picture.
void Renderer::draw_linear(const Pose &pose, const Sample &sample) {
    set_views(pose, sample);
    if (frame_.meter != nullptr) {
        frame_.meter->stop(frame_.meter->views());
    }
    frame_.shared = Shared();
    for_each_pass(&Pass::update);
    for_each_pass(&Pass::prepare);
    frame_.draw_view(frame_.view(ViewKind::main), main_.framebuffer());
    picture_ = 0;
    main_.resolve(frame_, pictures_[picture_].framebuffer.name());
    frame_.shared.picture = &pictures_[picture_].color;
    const bool filters = has_filters_now();
    if (filters) {
        main_.resolve_depth(depth_framebuffer_.name());
        frame_.shared.depth = &resolved_depth_;
    }
    if (frame_.meter != nullptr) {
        frame_.meter->stop(frame_.meter->resolve());
    }
    if (filters) {
        filter();
    }
}

void Renderer::finish() {
    if (has_post_) {
        for_each_pass(&Pass::finish);
    } else {
        const unsigned shown = pictures_[picture_].framebuffer.name();
        gl::blit_color(shown, frame_.width_px, frame_.height_px, output_.name(), width_px_, height_px_);
    }
    ++frame_.clock.frame;
    draw_calls_ = gl::draw_calls() - first_draw_call_;
}

void Renderer::draw(double elapsed_s, const Pose &pose) {
    begin_frame(elapsed_s);
    draw_linear(pose, {});
    finish();
}

void Renderer::draw_mean(double elapsed_s, const Pose &pose, const std::vector<Sample> &samples,
                         const std::function<void()> &drawn) {
    begin_frame(elapsed_s);
    std::vector<float> pixels;
    std::vector<double> sum;
    for (const Sample &sample : samples) {
        draw_linear(pose, sample);
        read_linear(pixels);
        sum.resize(pixels.size());
        std::ranges::transform(pixels, sum, sum.begin(),
                               [](float p, double s) { return s + static_cast<double>(p); });
        drawn();
    }
    std::ranges::transform(sum, pixels.begin(), [&](double s) {
        return static_cast<float>(s / static_cast<double>(samples.size()));
    });
    gl::write_target(pictures_[picture_].color, frame_.width_px, frame_.height_px, pixels);
    finish();
}

std::vector<std::pair<std::string_view, double>> Renderer::measure_passes(double elapsed_s, const Pose &pose,
                                                                          MeterClock clock) {
    PassMeter meter(passes_.size(), clock);
    begin_frame(elapsed_s);
    frame_.meter = &meter;
    meter.start();
    draw_linear(pose, {});
    finish();
    frame_.meter = nullptr;
    const std::vector<double> ms = meter.ms();
    std::vector<std::pair<std::string_view, double>> out{{"views", ms[meter.views()]},
                                                         {"clear", ms[meter.clear()]}};
    for (std::size_t i = 0; i < passes_.size(); ++i) {
        out.emplace_back(pass_names()[pass_indices_[i]], ms[i]);
    }
    out.emplace_back("resolve", ms[meter.resolve()]);
    return out;
}

std::optional<TerrainCounts> Renderer::terrain_counts() const {
    return frame_.terrain_ ? std::optional(frame_.terrain_->counts()) : std::nullopt;
}

unsigned Renderer::output() const {
    return output_.name();
}

void Renderer::read_picture(std::vector<std::uint8_t> &pixels) const {
    const std::size_t row = static_cast<std::size_t>(width_px_) * 3;
    pixels.resize(row * static_cast<std::size_t>(height_px_));
    glBindFramebuffer(GL_READ_FRAMEBUFFER, output_.name());
    glReadPixels(0, 0, width_px_, height_px_, GL_RGB, GL_UNSIGNED_BYTE, pixels.data());
    for (std::size_t top = 0, bottom = static_cast<std::size_t>(height_px_); top + 1 < bottom--; ++top) {
        std::swap_ranges(pixels.begin() + static_cast<std::ptrdiff_t>(top * row),
                         pixels.begin() + static_cast<std::ptrdiff_t>((top + 1) * row),
                         pixels.begin() + static_cast<std::ptrdiff_t>(bottom * row));
    }
}

void Renderer::read_linear(std::vector<float> &pixels) const {
    pixels.resize(static_cast<std::size_t>(frame_.width_px) * static_cast<std::size_t>(frame_.height_px) * 4);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, pictures_[picture_].framebuffer.name());
    glReadPixels(0, 0, frame_.width_px, frame_.height_px, GL_RGBA, GL_FLOAT, pixels.data());
}

std::optional<BadPixel> Renderer::find_bad_pixel() const {
    std::vector<float> pixels;
    read_linear(pixels);
    const auto bad =
        std::find_if(pixels.begin(), pixels.end(), [](float value) { return !std::isfinite(value); });
    if (bad == pixels.end()) {
        return std::nullopt;
    }
    const auto pixel = (bad - pixels.begin()) / 4;
    BadPixel out;
    out.x = static_cast<int>(pixel % frame_.width_px);
    out.y = frame_.height_px - 1 - static_cast<int>(pixel / frame_.width_px);
    std::copy_n(pixels.begin() + pixel * 4, 4, out.value);
    return out;
}

} // namespace paradize
