#include "app/playback.hpp"

#include "app/messages.hpp"
#include "app/png.hpp"
#include "app/window.hpp"
#include "error.hpp"
#include "gl/debug.hpp"
#include "number_text.hpp"
#include "passes/pass_meter.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <cstdio>
#include <utility>

namespace paradize {

namespace {

constexpr std::size_t upload_bytes_per_frame = std::size_t{4} << 20U;
constexpr double upload_ms_per_frame = 2.0; // in a window
// The first frame follows on none that it could delay, and is worth little without what shows most.
constexpr std::size_t first_upload_bytes = std::size_t{16} << 20U;
constexpr double first_upload_ms = 50.0;
constexpr int pass_frames = 10; // frames of --bench that wait for each pass

Device device() {
    Device out;
    out.software = gl::software_renderer();
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &out.max_texture_px);
    return out;
}

std::vector<QualityFeature> available_features(const assets::SceneFile &file, const Device &device) {
    std::vector<QualityFeature> out;
    for (std::size_t i = 0; i < feature_count; ++i) {
        if (has_feature(file, static_cast<QualityFeature>(i), device)) {
            out.push_back(static_cast<QualityFeature>(i));
        }
    }
    return out;
}

void log_unless_empty(const std::string &text) {
    if (!text.empty()) {
        log_message(text);
    }
}

} // namespace

UploadBudget frame_budget(bool first, bool headless, UploadOrder order) {
    const bool by_file = order == UploadOrder::file;
    UploadBudget out{.bytes = upload_bytes_per_frame,
                     .urgent_bytes = first && !by_file ? first_upload_bytes : 0};
    if (headless) { // waits for data, so that it does not depend on timing
        out.not_ready = by_file ? NotReady::wait : NotReady::wait_if_seen;
    } else {
        out.ms = first ? first_upload_ms : upload_ms_per_frame;
        out.not_ready = NotReady::skip;
    }
    return out;
}

PosesAhead poses_ahead(const Pose &pose, const Pose &before, double delta_s, const Horizons &horizons_s) {
    PosesAhead out;
    for (std::size_t i = 0; i < out.size(); ++i) {
        const double steps = delta_s > 0.0 ? horizons_s[i] / delta_s : 0.0;
        out[i] = pose;
        out[i].eye += (pose.eye - before.eye) * steps;
        out[i].target += (pose.eye - before.eye) * steps;
    }
    return out;
}

MemoryLimits memory_limits(const Options &options) {
    MemoryLimits out;
    out.order = options.file_order ? UploadOrder::file : UploadOrder::needs;
    out.vram_bytes = static_cast<std::uint64_t>(options.vram_mb.value_or(0.0) * 1e6);
    if (options.ram_mb) {
        out.ram_bytes = static_cast<std::uint64_t>(*options.ram_mb * 1e6);
    }
    return out;
}

RenderSettings chosen_settings(const Options &options, const assets::SceneFile &file) {
    return options.reference ? reference_settings(file, *options.reference, device())
                             : render_settings(file, options.quality, device());
}

Playback::Playback(const Options &options, PendingScene pending, const RendererOptions &renderer_options,
                   assets::SceneWatcher *watcher, double started_ms)
    : options_(options), started_ms_(started_ms), renderer_options_(renderer_options),
      scenes_(std::move(pending), options.folder, memory_limits(options), watcher),
      shaders_(gl::ShaderLibrary::find()), device_(device()), features_(available_features(file(), device_)) {
    warn_of_terrain_size();
    scenes_.begin_reading(
        flight_forecast(options.time_s, renderer_options.width_px, renderer_options.height_px));
    renderer_ = std::make_unique<Renderer>(scenes_.current().scene, shaders_, renderer_options);
    if (options.wait_resident || options.bench || options.fps ||
        (!options.screenshot.empty() && !options.frames)) {
        scenes_.upload_all(flight_forecast(options.time_s));
    }
    if (options.reference) {
        samples_ = reference_samples(*options.reference);
    }
    gl::check_memory();
    if (options.fps) {
        rate_.emplace(*options.fps, *renderer_, file(), features_, device_, options.time_s, options.folder);
        apply(rate_->quality());
    }
}

void Playback::check_free_camera(const glm::dvec3 &eye) {
    log_unless_empty(bake_limits_->check_camera(eye));
}

void Playback::reserve_frames(std::size_t frames) {
    frame_ms_.reserve(frames);
    scene_ms_.reserve(frames);
    moments_.reserve(options_.frames ? frames : 1);
    if (options_.headless) {
        progress_.emplace(frames * std::max<std::size_t>(1, samples_.size()), now_ms());
    }
}

void Playback::tell_progress() {
    if (!progress_) {
        return;
    }
    if (const std::optional<double> left_s = progress_->drawn(now_ms())) {
        log_progress(progress_->count(), progress_->frames(), *left_s);
    }
}

void Playback::record_frame_time(double ms) {
    if (frame_ms_.size() < frame_ms_.capacity()) {
        frame_ms_.push_back(ms);
        scene_ms_.push_back(renderer_->scene_ms());
    }
    most_draw_calls_ = std::max(most_draw_calls_, renderer_->draw_calls());
    if (moments_.size() < moments_.capacity()) {
        const StreamingCounts &counts = scenes_.current().streamer.counts();
        moments_.push_back(
            {(now_ms() - started_ms_) / 1e3, counts.worst_error, stream_ms_, counts.uploaded_bytes});
    }
    if (rate_ && rate_->observe(ms)) {
        apply(rate_->quality());
    }
}

void Playback::measure_passes(double elapsed_s) {
    std::vector<std::vector<double>> times;
    for (int i = 0; i < pass_frames; ++i) {
        const double now_s = elapsed_s + i * frame_s;
        const auto passes = renderer_->measure_passes(now_s, flight_pose(file().flight, now_s), meter_clock_);
        times.resize(passes.size());
        passes_ms_.clear();
        for (std::size_t p = 0; p < passes.size(); ++p) {
            times[p].push_back(passes[p].second);
            passes_ms_.emplace_back(passes[p].first, median(times[p]));
        }
    }
}

void Playback::show_panel(Window &window, double now_s) {
    if (options_.panel && now_s >= panel_s_) {
        panel_s_ = now_s + 1.0;
        window.set_title(panel_line(printable(file().name), scenes_.current().streamer.counts()));
    }
}

/// Headless frames must not depend on timing.
Horizons Playback::horizons_s() const {
    return options_.headless ? near_horizons_s
                             : horizons_for(scenes_.current().streamer.counts().read_bytes_per_s);
}

CameraForecast Playback::flight_forecast(double elapsed_s) const {
    return flight_forecast(elapsed_s, renderer_->width_px(), renderer_->height_px());
}

CameraForecast Playback::flight_forecast(double elapsed_s, int width_px, int height_px) const {
    CameraForecast out{renderer_options_.settings,
                       width_px,
                       height_px,
                       flight_pose(file().flight, elapsed_s),
                       {},
                       elapsed_s,
                       false,
                       horizons_s()};
    for (std::size_t i = 0; i < out.soon.size(); ++i) {
        out.soon[i] = flight_pose(file().flight, elapsed_s + out.horizons_s[i]);
    }
    return out;
}

CameraForecast Playback::steered_forecast(const Pose &pose, const Pose &before, double elapsed_s,
                                          double delta_s) const {
    CameraForecast out{renderer_options_.settings,
                       renderer_->width_px(),
                       renderer_->height_px(),
                       pose,
                       {},
                       elapsed_s,
                       true,
                       horizons_s()};
    out.soon = poses_ahead(pose, before, delta_s, out.horizons_s);
    return out;
}

void Playback::frame(double elapsed_s, const CameraForecast &forecast, gl::DebugLog &log) {
    const Pose &pose = forecast.now;
    log_unless_empty(bake_limits_->check_size(renderer_->width_px(), renderer_->height_px()));
    // In a window some frames may pass before a file is checked.
    const bool is_first = scenes_.current().streamer.counts().uploaded_bytes == 0;
    const UploadBudget budget = frame_budget(is_first, options_.headless,
                                             options_.file_order ? UploadOrder::file : UploadOrder::needs);
    stream_ms_ = 0.0;
    {
        const CpuTimer timer(stream_ms_);
        if (LoadedScene *next = scenes_.upload(forecast, budget)) {
            activate(*next, elapsed_s);
        }
    }
    warn_of_memory_limit(elapsed_s);
    if (samples_.empty()) {
        renderer_->draw(elapsed_s, pose);
        tell_progress();
    } else {
        renderer_->draw_mean(elapsed_s, pose, samples_, [this] { tell_progress(); });
    }
    if (options_.debug) {
        log.throw_on_error();
    }
    if (options_.check_finite) {
        if (const auto bad = renderer_->find_bad_pixel()) {
            char text[160];
            std::snprintf(text, sizeof text, "second %.4f, pixel (%d, %d): the picture is (%g, %g, %g, %g)",
                          elapsed_s, bad->x, bad->y, static_cast<double>(bad->value[0]),
                          static_cast<double>(bad->value[1]), static_cast<double>(bad->value[2]),
                          static_cast<double>(bad->value[3]));
            throw Error(text);
        }
    }
}

void Playback::save(const std::filesystem::path &path) {
    renderer_->read_picture(pixels_);
    write_png(path, pixels_, renderer_->width_px(), renderer_->height_px());
    screenshots_.push_back(path.string());
}

Report Playback::report() const {
    Report out;
    out.width_px = renderer_->width_px();
    out.height_px = renderer_->height_px();
    out.frame_ms = frame_ms_;
    out.scene_ms = scene_ms_;
    out.moments = moments_;
    out.bench = options_.bench;
    out.passes_ms = passes_ms_;
    out.passes_clock = meter_clock_;
    out.quality = rate_ ? rate_->quality() : options_.quality;
    out.features = features_;
    out.reference = options_.reference;
    if (rate_) {
        out.fps = rate_->report(frame_ms_);
    }
    out.streaming = scenes_.current().streamer.counts();
    out.draw_calls = renderer_->draw_calls();
    out.most_draw_calls = most_draw_calls_;
    out.terrain = renderer_->terrain_counts();
    out.renderer = gl::renderer_name();
    out.version = gl::version_name();
    out.screenshots = screenshots_;
    out.exceeded_limits = bake_limits_->messages();
    return out;
}

void Playback::apply(const Quality &quality) {
    renderer_options_.settings = render_settings(file(), quality, device_);
    renderer_->change_settings(renderer_options_.settings);
}

void Playback::warn_of_terrain_size() const {
    if (!options_.vram_mb && !file().vram_mb) {
        log_unless_empty(terrain_warning(scenes_.current().streamer.counts().terrain_bytes));
    }
}

void Playback::warn_of_memory_limit(double elapsed_s) {
    const double limit_mb = options_.vram_mb.value_or(file().vram_mb.value_or(0.0));
    const double needed_mb = static_cast<double>(scenes_.current().streamer.counts().needed_bytes) / 1e6;
    if (limit_mb <= 0.0 || needed_mb <= limit_mb || warned_of_memory_) {
        return;
    }
    warned_of_memory_ = true;
    log_message((options_.vram_mb ? "--vram: " : "vram_mb: ") + shortest(limit_mb) +
                " MB of device memory cannot hold the " + fixed(needed_mb, 1) +
                " MB that the picture needs at second " + fixed(elapsed_s, 1) +
                "; mips and levels of detail that show least are coarser or missing");
}

void Playback::activate(LoadedScene &next, double elapsed_s) {
    const std::uint64_t terrain_bytes = scenes_.current().streamer.counts().terrain_bytes;
    RendererOptions renderer_options = renderer_options_; // those of the current scene, should the next fail
    renderer_options.width_px = renderer_->width_px();
    renderer_options.height_px = renderer_->height_px();
    renderer_options.settings =
        rate_ ? render_settings(next.file, rate_->quality(), device_) : chosen_settings(options_, next.file);
    try {
        auto renderer = std::make_unique<Renderer>(next.scene, shaders_, renderer_options);
        gl::check_memory();
        renderer->continue_from(*renderer_);
        const std::unique_ptr<LoadedScene> before = scenes_.activate();
        renderer_ = std::move(renderer); // destroys the previous renderer, then the previous scene
        renderer_options_ = std::move(renderer_options);
        bake_limits_ = std::make_unique<BakeLimits>(file());
    } catch (const Error &error) {
        scenes_.refuse(error.what());
        return;
    }
    if (scenes_.current().streamer.counts().terrain_bytes > terrain_bytes) {
        warn_of_terrain_size();
    }
    const std::size_t all = file().artifacts.size();
    log_message("scene.json was replaced: " + std::to_string(all - scenes_.current().streamer.reused()) +
                " of " + std::to_string(all) + " artifacts are new; shown from second " +
                fixed(elapsed_s, 3) + " on");
}

} // namespace paradize
