#include "app/playback.hpp"

#include "app/audio.hpp"
#include "app/calibration.hpp"
#include "app/free_camera.hpp"
#include "app/messages.hpp"
#include "app/png.hpp"
#include "app/report.hpp"
#include "app/scene_swap.hpp"
#include "app/window.hpp"
#include "assets/file_bytes.hpp"
#include "assets/json_reader.hpp"
#include "assets/loaded_artifact.hpp"
#include "assets/scene_file.hpp"
#include "assets/tradeoff_file.hpp"
#include "assets/watcher.hpp"
#include "error.hpp"
#include "gl/debug.hpp"
#include "gl/framebuffer.hpp"
#include "gl/headless.hpp"
#include "gl/shader_library.hpp"
#include "gl/timestamp.hpp"
#include "number_text.hpp"
#include "render/renderer.hpp"
#include "scene/bake_limits.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <utility>

namespace paradize {

namespace {

constexpr std::size_t upload_bytes_per_frame = std::size_t{4} << 20U;
constexpr double upload_ms_per_frame = 2.0; // in a window
constexpr double frame_s = 1.0 / 30.0;      // between two frames of --frames
constexpr int bench_frames = 100;           // measured frames of --bench; --frames overrides it
constexpr int warm_up_frames = 5; // untimed frames before them: drivers compile shaders at the first draw
constexpr int pass_frames = 10;   // frames of --bench that wait for each pass
constexpr std::size_t max_recent_frames = 4096; // frame times that --fps keeps
// upper limit of a time step, so that a suspended machine does not skip ahead
constexpr double max_delta_s = 0.25;
constexpr float volume_step = 0.1F;

assets::SceneFile load_scene(const std::filesystem::path &folder) {
    const std::filesystem::path path = folder / "scene.json";
    std::error_code unknown; // errors other than a missing file are reported when the file is opened
    if (!std::filesystem::exists(path, unknown) && !unknown) {
        throw Error(path.string() +
                    ": there is no such file; `paradize bake SCENE.toml` writes a scene folder");
    }
    return assets::read_scene(path);
}

Device device() {
    Device out;
    out.software = gl::software_renderer();
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &out.max_texture_px);
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

std::vector<QualityFeature> available_features(const assets::SceneFile &file, const Device &device) {
    std::vector<QualityFeature> out;
    for (std::size_t i = 0; i < feature_count; ++i) {
        if (has_feature(file, static_cast<QualityFeature>(i), device)) {
            out.push_back(static_cast<QualityFeature>(i));
        }
    }
    return out;
}

/// Loads the errors of the quality features for this scene, which `paradize measure` may have written beside
/// the folder: island.tradeoff.json beside island/. Returns an empty list if there is no such file.
std::vector<assets::FeatureError> load_tradeoff(const std::filesystem::path &folder) {
    std::filesystem::path path = std::filesystem::absolute(folder).lexically_normal();
    path = path.has_filename() ? path : path.parent_path();
    path += ".tradeoff.json";
    std::error_code unknown;
    if (!std::filesystem::exists(path, unknown)) {
        return {};
    }
    const assets::FileBytes file(path, {.max = assets::max_json_bytes});
    const auto bytes = file.bytes();
    return assets::parse_tradeoff({reinterpret_cast<const char *>(bytes.data()), bytes.size()}, path);
}

/// Plays one scene folder. It lives as long as the GL context.
class Playback {
  public:
    /// `watcher` supplies scenes that replace the first one. nullptr: the scene is never replaced.
    Playback(const Options &options, PendingScene pending, const RendererOptions &renderer_options,
             assets::SceneWatcher *watcher, double started_ms)
        : options_(options), started_ms_(started_ms), renderer_options_(renderer_options),
          scenes_(std::move(pending), options.folder, memory_limits(options), watcher),
          shaders_(gl::ShaderLibrary::find()),
          renderer_(std::make_unique<Renderer>(scenes_.current().scene, shaders_, renderer_options)) {
        warn_of_terrain_size();
        if (options.wait_resident || options.bench || options.fps ||
            (!options.screenshot.empty() && !options.frames)) {
            scenes_.upload_all(flight_outlook(options.time_s));
        }
        if (options.reference) {
            samples_ = reference_samples(*options.reference);
        }
        gl::check_memory();
        if (options.fps) {
            start_frame_governor(*options.fps);
        }
    }

    /// Warns once if the free camera leaves the region that the scene was baked for.
    void check_free_camera(const glm::dvec3 &eye) { log_unless_empty(bake_limits_->check_camera(eye)); }

    const assets::SceneFile &file() const { return scenes_.current().file; }
    Renderer &renderer() { return *renderer_; }
    /// Frames to record. Their recording allocates nothing.
    void reserve_frames(std::size_t frames) {
        frame_ms_.reserve(frames);
        scene_ms_.reserve(frames);
        moments_.reserve(options_.frames ? frames : 1);
    }

    /// Records the duration of a finished frame, and adjusts the quality for --fps.
    void record_frame_time(double ms) {
        if (frame_ms_.size() < frame_ms_.capacity()) {
            frame_ms_.push_back(ms);
            scene_ms_.push_back(renderer_->scene_ms());
        }
        if (moments_.size() < moments_.capacity()) {
            moments_.push_back(
                {(now_ms() - started_ms_) / 1e3, scenes_.current().streamer.counts().worst_error});
        }
        if (!governor_) {
            return;
        }
        recent_ms_.push_back(ms);
        if (governor_->observe(ms)) {
            recent_ms_.clear();
            apply(governor_->current().quality);
        }
        if (recent_ms_.size() == max_recent_frames) {
            recent_ms_.erase(recent_ms_.begin(), recent_ms_.begin() + max_recent_frames / 2);
        }
    }

    void measure_passes(double elapsed_s) {
        std::vector<std::vector<double>> times;
        for (int i = 0; i < pass_frames; ++i) {
            const double now_s = elapsed_s + i * frame_s;
            const auto passes =
                renderer_->measure_passes(now_s, flight_pose(file().flight, now_s), meter_clock_);
            times.resize(passes.size());
            passes_ms_.clear();
            for (std::size_t p = 0; p < passes.size(); ++p) {
                times[p].push_back(passes[p].second);
                passes_ms_.emplace_back(passes[p].first, median(times[p]));
            }
        }
    }

    /// Shows in the window's title how streaming stands; at most once a second, because it allocates.
    void show_panel(Window &window, double now_s) {
        if (options_.panel && now_s >= panel_s_) {
            panel_s_ = now_s + 1.0;
            window.set_title(panel_line(printable(file().name), scenes_.current().streamer.counts()));
        }
    }

    /// Where the flight leads from this time on.
    Outlook flight_outlook(double elapsed_s) const {
        Outlook out{renderer_options_.settings,
                    renderer_->width_px(),
                    renderer_->height_px(),
                    flight_pose(file().flight, elapsed_s),
                    {}};
        for (std::size_t i = 0; i < horizons_s.size(); ++i) {
            out.soon[i] = flight_pose(file().flight, elapsed_s + horizons_s[i]);
        }
        return out;
    }

    /// Where a steered camera heads, if it goes on as since the last frame.
    Outlook steered_outlook(const Pose &pose, const Pose &before, double delta_s) const {
        Outlook out{renderer_options_.settings, renderer_->width_px(), renderer_->height_px(), pose, {}};
        for (std::size_t i = 0; i < horizons_s.size(); ++i) {
            const double steps = delta_s > 0.0 ? horizons_s[i] / delta_s : 0.0;
            out.soon[i] = pose;
            out.soon[i].eye += (pose.eye - before.eye) * steps;
            out.soon[i].target += (pose.eye - before.eye) * steps;
        }
        return out;
    }

    void frame(double elapsed_s, const Outlook &outlook, gl::DebugLog &log) {
        const Pose &pose = outlook.now;
        // Headless frames wait for data, so that they do not depend on timing. Frames in a window do not
        // wait.
        log_unless_empty(bake_limits_->check_size(renderer_->width_px(), renderer_->height_px()));
        const UploadBudget budget =
            options_.headless
                ? UploadBudget{.bytes = upload_bytes_per_frame,
                               .not_ready = options_.file_order ? NotReady::wait : NotReady::wait_if_seen}
                : UploadBudget{upload_bytes_per_frame, upload_ms_per_frame, NotReady::skip};
        if (LoadedScene *next = scenes_.upload(outlook, budget)) {
            activate(*next, elapsed_s);
        }
        warn_of_memory_limit(elapsed_s);
        if (samples_.empty()) {
            renderer_->draw(elapsed_s, pose);
        } else {
            renderer_->draw_mean(elapsed_s, pose, samples_);
        }
        if (options_.debug) {
            log.throw_on_error();
        }
        if (options_.check_finite) {
            if (const auto bad = renderer_->find_bad_pixel()) {
                char text[160];
                std::snprintf(text, sizeof text,
                              "second %.4f, pixel (%d, %d): the picture is (%g, %g, %g, %g)", elapsed_s,
                              bad->x, bad->y, static_cast<double>(bad->value[0]),
                              static_cast<double>(bad->value[1]), static_cast<double>(bad->value[2]),
                              static_cast<double>(bad->value[3]));
                throw Error(text);
            }
        }
    }

    /// Waits until all files of the scene are checked. Throws Error if one is damaged.
    void finish_checks() { scenes_.current().streamer.finish_checks(); }

    void save(const std::filesystem::path &path) {
        renderer_->read_picture(pixels_);
        write_png(path, pixels_, renderer_->width_px(), renderer_->height_px());
        screenshots_.push_back(path.string());
    }

    Report report() const {
        Report out;
        out.width_px = renderer_->width_px();
        out.height_px = renderer_->height_px();
        out.frame_ms = frame_ms_;
        out.scene_ms = scene_ms_;
        out.moments = moments_;
        out.bench = options_.bench;
        out.passes_ms = passes_ms_;
        out.passes_clock = meter_clock_;
        out.quality = governor_ ? governor_->current().quality : options_.quality;
        out.features = features_;
        out.reference = options_.reference;
        if (governor_) {
            out.fps = FrameRate{*options_.fps,           governor_->current().quality,
                                governor_->current().ms, median(recent_ms_.empty() ? frame_ms_ : recent_ms_),
                                governor_->changes(),    calibration_.table};
        }
        out.streaming = scenes_.current().streamer.counts();
        out.draw_calls = renderer_->draw_calls();
        out.terrain = renderer_->terrain_counts();
        out.renderer = gl::renderer_name();
        out.version = gl::version_name();
        out.screenshots = screenshots_;
        out.exceeded_limits = bake_limits_->messages();
        return out;
    }

  private:
    void apply(const Quality &quality) {
        renderer_options_.settings = render_settings(file(), quality, device_);
        renderer_->change_settings(renderer_options_.settings);
    }

    /// Calibrates, chooses the first quality and logs both.
    void start_frame_governor(double fps) {
        calibration_ = calibrate(*renderer_, file(), features_, device_, options_.time_s,
                                 load_tradeoff(options_.folder));
        governor_.emplace(pareto_front(calibration_.table, features_, calibration_.base_ms), 1000.0 / fps);
        recent_ms_.reserve(max_recent_frames);
        apply(governor_->current().quality);
        const std::string wanted = "--fps " + shortest(fps) + ": ";
        const std::string expected = fixed(governor_->current().ms, 3) + " ms";
        log_message(wanted + to_text(governor_->current().quality) + "; expected " + expected + " per frame");
        if (governor_->out_of_reach()) {
            log_message(wanted + "the budget is " + fixed(governor_->budget_ms(), 3) +
                        " ms per frame, the fastest quality needs " + expected + "; use a smaller --size");
        }
    }

    static void log_unless_empty(const std::string &text) {
        if (!text.empty()) {
            log_message(text);
        }
    }

    void warn_of_terrain_size() const {
        if (!options_.vram_mb && !file().vram_mb) {
            log_unless_empty(terrain_warning(scenes_.current().streamer.counts().terrain_bytes));
        }
    }

    /// Warns once if the picture needs more than the limit of device memory.
    void warn_of_memory_limit(double elapsed_s) {
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

    /// Replaces the scene by `next`. Playback time and camera stay.
    void activate(LoadedScene &next, double elapsed_s) {
        const std::uint64_t terrain_bytes = scenes_.current().streamer.counts().terrain_bytes;
        renderer_options_.width_px = renderer_->width_px();
        renderer_options_.height_px = renderer_->height_px();
        renderer_options_.settings = governor_
                                         ? render_settings(next.file, governor_->current().quality, device_)
                                         : chosen_settings(options_, next.file);
        try {
            auto renderer = std::make_unique<Renderer>(next.scene, shaders_, renderer_options_);
            gl::check_memory();
            renderer->continue_from(*renderer_);
            const std::unique_ptr<LoadedScene> before = scenes_.activate();
            renderer_ = std::move(renderer); // destroys the previous renderer, then the previous scene
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

    const Options &options_;
    const double started_ms_;
    RendererOptions renderer_options_;
    SceneSwap scenes_;
    bool warned_of_memory_ = false;
    std::unique_ptr<BakeLimits> bake_limits_ = std::make_unique<BakeLimits>(file());
    gl::ShaderLibrary shaders_;
    std::unique_ptr<Renderer> renderer_;
    std::vector<Sample> samples_;             // of --reference, otherwise empty
    std::vector<double> frame_ms_, scene_ms_; // one entry per frame
    std::vector<StreamingMoment> moments_;
    double panel_s_ = 0.0; // when the panel is written again
    std::vector<std::uint8_t> pixels_;
    std::vector<std::string> screenshots_;
    Device device_ = device();
    std::vector<QualityFeature> features_ = available_features(file(), device_);
    Calibration calibration_; // this and the next two members belong to --fps
    std::optional<FrameGovernor> governor_;
    std::vector<double> recent_ms_; // since the last change of quality
    std::vector<std::pair<std::string, double>> passes_ms_;
    MeterClock meter_clock_ = gl::has_timestamps() ? MeterClock::device : MeterClock::processor;
};

/// poster.png -> poster_0007.png
std::filesystem::path numbered(const std::filesystem::path &path, int number) {
    char digits[16];
    std::snprintf(digits, sizeof digits, "_%04d", number);
    std::filesystem::path out = path;
    out.replace_filename(path.stem().string() + digits + path.extension().string());
    return out;
}

/// Draws a fixed number of frames, 1/30 s apart.
void play_frames(Playback &playback, const Options &options, gl::DebugLog &log, Window *window) {
    const int before = options.bench ? warm_up_frames : 0;
    const int frames = before + options.frames.value_or(options.bench ? bench_frames : 1);
    playback.reserve_frames(static_cast<std::size_t>(frames));
    for (int i = 0; i < frames; ++i) {
        const double elapsed_s = options.time_s + i * frame_s;
        if (options.bench) {
            glFinish(); // finishes the window's previous frame
        }
        const double start = now_ms();
        playback.frame(elapsed_s, playback.flight_outlook(elapsed_s), log);
        glFinish();
        if (i >= before) {
            playback.record_frame_time(now_ms() - start);
        }
        if (!options.screenshot.empty()) {
            playback.save(options.frames ? numbered(options.screenshot, i) : options.screenshot);
        }
        if (window != nullptr) {
            int width = 0;
            int height = 0;
            window->size(width, height);
            gl::blit_color(playback.renderer().output(), playback.renderer().width_px(),
                           playback.renderer().height_px(), 0, width, height);
            window->swap();
            playback.show_panel(*window, window->seconds());
            const Input input = window->poll();
            if (input.close || input.any_key) {
                return;
            }
        }
    }
    playback.finish_checks(); // so that exit code 0 says that all files are good
}

/// Plays the scene's sound. If that sound is already playing, it continues.
void start_sound(const assets::SceneFile &file, const Options &options, Audio &audio,
                 std::string &loaded_sha256, bool &muted) {
    const assets::Artifact *sound = file.sound ? file.find_artifact(file.sound->artifact) : nullptr;
    if (sound == nullptr) {
        audio.stop();
        loaded_sha256.clear();
        return;
    }
    if (options.mute || (sound->sha256 == loaded_sha256 && !loaded_sha256.empty())) {
        return;
    }
    loaded_sha256 = sound->sha256;
    try {
        const assets::FileBytes bytes = assets::read_artifact(*sound, options.folder);
        muted = !audio.load(bytes.bytes(), sound->file);
    } catch (const Error &error) { // the file has changed since the scene was loaded
        log_message(std::string("no sound: ") + error.what());
        audio.stop();
        muted = true;
    }
    audio.set_volume(file.sound->volume);
    audio.play();
}

/// Runs until a key, Escape or the close button ends playback.
void play_window(Playback &playback, const Options &options, gl::DebugLog &log, Window &window) {
    Audio audio;
    bool muted = true;
    std::string loaded_sha256; // of the sound that is playing
    start_sound(playback.file(), options, audio, loaded_sha256, muted);
    playback.reserve_frames(1U << 20U);
    FreeCamera camera(flight_pose(playback.file().flight, options.time_s));
    double elapsed_s = options.time_s;
    double last_s = window.seconds();
    bool paused = false;
    while (true) {
        const Input input = window.poll();
        if (input.close || (options.interactive ? input.escape : input.any_key)) {
            audio.stop();
            return;
        }
        const double now_s = window.seconds();
        const double delta_s = std::clamp(now_s - last_s, 0.0, max_delta_s);
        last_s = now_s;
        const Pose before = camera.pose();
        if (options.interactive) {
            camera.move(input, delta_s);
            playback.check_free_camera(camera.pose().eye);
            if (input.pause) {
                paused = !paused;
            }
            if (input.mute) {
                muted = !muted;
            }
            if (input.pause || input.mute) {
                paused || muted ? audio.pause() : audio.play();
            }
            if (input.volume_steps != 0) {
                audio.set_volume(audio.volume() + volume_step * static_cast<float>(input.volume_steps));
            }
        }
        elapsed_s += paused ? 0.0 : delta_s;
        int width = 0;
        int height = 0;
        window.size(width, height);
        if (!window.minimised()) {
            playback.renderer().resize(width, height);
        }
        const double start = now_ms();
        const assets::SceneFile *shown = &playback.file();
        playback.frame(elapsed_s,
                       options.interactive ? playback.steered_outlook(camera.pose(), before, delta_s)
                                           : playback.flight_outlook(elapsed_s),
                       log);
        gl::blit_color(playback.renderer().output(), playback.renderer().width_px(),
                       playback.renderer().height_px(), 0, width, height);
        if (options.fps) {
            glFinish(); // measure the drawing, not the wait for the display
            playback.record_frame_time(now_ms() - start);
        }
        window.swap();
        playback.show_panel(window, now_s);
        if (shown != &playback.file()) {
            start_sound(playback.file(), options, audio, loaded_sha256, muted);
        }
        if (!options.fps) {
            playback.record_frame_time(now_ms() - start);
        }
    }
}

} // namespace

int run(const Options &options) {
    const double started_ms = now_ms();
    const bool counted = options.headless || options.bench || options.frames || !options.screenshot.empty();
    // created before scene.json is read, so that no change is missed
    std::optional<assets::SceneWatcher> watcher;
    if (!options.bench && !options.reference && (!counted || options.frames)) {
        watcher.emplace(options.folder / "scene.json");
    }
    // Threads read the files while the GL context is created.
    PendingScene pending(load_scene(options.folder), options.folder, memory_limits(options));
    const assets::SceneFile &file = *pending.file;
    RendererOptions renderer_options;
    renderer_options.width_px = options.width_px.value_or(file.width_px);
    renderer_options.height_px = options.height_px.value_or(file.height_px);
    renderer_options.disabled = options.disabled;

    std::unique_ptr<gl::HeadlessContext> headless;
    std::unique_ptr<Window> window;
    if (options.headless) {
        headless = std::make_unique<gl::HeadlessContext>(options.debug);
    } else {
        window = std::make_unique<Window>(
            Window::Settings{printable(file.name), renderer_options.width_px, renderer_options.height_px,
                             options.screenshot.empty(), options.interactive, options.debug});
    }
    renderer_options.settings = chosen_settings(options, file);
    gl::DebugLog log;
    if (options.debug) {
        log.install();
    }
    Playback playback(options, std::move(pending), renderer_options, watcher ? &*watcher : nullptr,
                      started_ms);
    if (options.debug) {
        log.throw_on_error();
    }
    if (counted) {
        play_frames(playback, options, log, window.get());
    } else {
        play_window(playback, options, log, *window);
    }
    if (options.bench) {
        playback.measure_passes(options.time_s);
    }
    if (options.json) {
        print(to_json(playback.report()) + "\n");
    } else if (options.bench) {
        print(bench_line(playback.report()) + "\n");
    } else if (options.fps) {
        print(fps_line(*playback.report().fps) + "\n");
    }
    return 0;
}

} // namespace paradize
