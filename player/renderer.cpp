#include "renderer.hpp"

#include "camera.hpp"
#include "gl/debug.hpp"
#include "gl/framebuffer.hpp"
#include "gl/texture.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>

namespace paradize {

namespace {

// A show that begins later than this begins its simulation this long before, so that --time never takes long.
constexpr std::uint64_t most_steps = 600 * 120;
constexpr float anisotropy = 4.0F; // of a graphics card; a software rasteriser pays half a frame for it

std::vector<std::unique_ptr<Pass>> build(const Scene &scene, const gl::ShaderLibrary &shaders,
                                         const std::vector<std::string> &disabled) {
    return make_passes({scene, shaders, gl::software_renderer() ? 1.0F : anisotropy}, disabled);
}

void set_default_state() {
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);
    glDepthMask(GL_TRUE);
    glEnable(GL_CULL_FACE);
    glCullFace(GL_BACK);
    glFrontFace(GL_CCW);
    glDisable(GL_BLEND);
    glDisable(GL_DITHER); // ours is in the last pass
    glEnable(GL_TEXTURE_CUBE_MAP_SEAMLESS);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
}

} // namespace

Renderer::Renderer(const Scene &scene, const gl::ShaderLibrary &shaders, const RendererSettings &settings)
    : scene_(scene), samples_(settings.samples), passes_(build(scene, shaders, settings.disabled)),
      has_post_(std::find(settings.disabled.begin(), settings.disabled.end(), "post") ==
                settings.disabled.end()),
      frame_(scene, passes_) {
    GLint most = 1;
    glGetIntegerv(GL_MAX_SAMPLES, &most);
    samples_ = std::min(samples_, most);
    set_default_state();
    resize(settings.width_px, settings.height_px);
}

Renderer::~Renderer() = default;

void Renderer::resize(int width_px, int height_px) {
    if (width_px == width_px_ && height_px == height_px_) {
        return;
    }
    width_px_ = width_px;
    height_px_ = height_px;
    color_ = gl::make_renderbuffer(GL_RGBA16F, width_px, height_px, samples_);
    depth_ = gl::make_renderbuffer(GL_DEPTH_COMPONENT24, width_px, height_px, samples_);
    picture_ = gl::make_target(GL_RGBA16F, width_px, height_px);
    final_ = gl::make_target(GL_RGBA8, width_px, height_px);
    drawn_ = gl::make_framebuffer(color_, depth_);
    resolved_ = gl::make_framebuffer(picture_, {});
    output_ = gl::make_framebuffer(final_, {});
    for (const std::unique_ptr<Pass> &pass : passes_) {
        pass->resize(width_px, height_px);
    }
    frame_.width_px = width_px;
    frame_.height_px = height_px;
    frame_.output = output_.name();
}

void Renderer::go_on(const Renderer &before) {
    bool all = true;
    for (const std::unique_ptr<Pass> &pass : passes_) {
        all = pass->go_on(before.passes_) && all;
    }
    if (all) {
        steps_ = before.steps_;
        frame_.clock = before.frame_.clock;
        last_s_ = before.last_s_;
    }
}

void Renderer::step_to(double elapsed_s) {
    const auto wanted = static_cast<std::uint64_t>(std::floor(elapsed_s / step_s + 1e-6));
    if (wanted > steps_ + most_steps) {
        steps_ = wanted - most_steps;
    }
    for (; steps_ < wanted; ++steps_) {
        const double time_s = static_cast<double>(steps_) * step_s;
        for (const std::unique_ptr<Pass> &pass : passes_) {
            pass->step(time_s);
        }
    }
}

void Renderer::set_views(const Pose &pose) {
    const assets::SceneFile &file = scene_.file();
    const auto place = [&](const View &view) { frame_.views_[static_cast<std::size_t>(view.kind)] = view; };
    const View main = main_view(pose, file.flight, width_px_, height_px_);
    const float level = file.water ? file.water->level_m : 0.0F;
    place(main);
    place(mirror_view(main, level, file.reflection_scale.value_or(1.0F)));
    place(refraction_view(main, level, file.refraction_scale.value_or(1.0F)));
    place(light_view(file.shadow.value_or(assets::Shadow()), file.sun.direction));
    if (frame_.terrain_) {
        frame_.terrain_->update(main, file.lod_error_px);
    }
    for (std::size_t i = 0; i < view_kinds; ++i) {
        const View &view = frame_.views_[i];
        const bool light = view.kind == ViewKind::light;
        frame_.visible_[i].clear();
        scene_.collect(view, light ? main.eye : view.eye, light ? main.pixels_at_1m : view.pixels_at_1m,
                       frame_.visible_[i]);
    }
}

void Renderer::draw(double elapsed_s, const Pose &pose) {
    step_to(elapsed_s);
    frame_.clock.delta_s = frame_.clock.frame == 0 ? 0.0 : elapsed_s - last_s_;
    frame_.clock.elapsed_s = elapsed_s;
    frame_.clock.flight_s = flight_second(elapsed_s, scene_.file().flight.duration_s);
    last_s_ = elapsed_s;
    set_views(pose);
    frame_.shared = Shared();
    for (const std::unique_ptr<Pass> &pass : passes_) {
        pass->prepare(frame_);
    }
    frame_.draw_view(frame_.view(ViewKind::main), drawn_.name());
    gl::blit_color(drawn_.name(), width_px_, height_px_, resolved_.name(), width_px_, height_px_);
    frame_.shared.picture = &picture_;
    if (has_post_) {
        for (const std::unique_ptr<Pass> &pass : passes_) {
            pass->finish(frame_);
        }
    } else {
        gl::blit_color(resolved_.name(), width_px_, height_px_, output_.name(), width_px_, height_px_);
    }
    ++frame_.clock.frame;
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

std::optional<BadPixel> Renderer::find_bad_pixel() const {
    std::vector<float> pixels(static_cast<std::size_t>(width_px_) * static_cast<std::size_t>(height_px_) * 4);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, resolved_.name());
    glReadPixels(0, 0, width_px_, height_px_, GL_RGBA, GL_FLOAT, pixels.data());
    const auto bad =
        std::find_if(pixels.begin(), pixels.end(), [](float value) { return !std::isfinite(value); });
    if (bad == pixels.end()) {
        return std::nullopt;
    }
    const auto pixel = (bad - pixels.begin()) / 4;
    BadPixel out;
    out.x = static_cast<int>(pixel % width_px_);
    out.y = height_px_ - 1 - static_cast<int>(pixel / width_px_);
    std::copy_n(pixels.begin() + pixel * 4, 4, out.value);
    return out;
}

} // namespace paradize
