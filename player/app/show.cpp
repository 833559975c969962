#include "app/show.hpp"

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
#include "assets/opened_artifact.hpp"
#include "assets/scene_file.hpp"
#include "assets/trade_file.hpp"
#include "assets/watcher.hpp"
#include "error.hpp"
#include "gl/debug.hpp"
#include "gl/framebuffer.hpp"
#include "gl/headless.hpp"
#include "gl/shader_library.hpp"
#include "number_text.hpp"
#include "render/renderer.hpp"
#include "scene/bake_limits.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

namespace paradize {

namespace {

constexpr std::size_t upload_bytes_per_frame = std::size_t{4} << 20U;
constexpr double frame_s = 1.0 / 30.0;         // between the frames of --frames
constexpr int bench_frames = 100;              // of --bench, unless --frames says otherwise
constexpr int unmeasured_frames = 5;           // of --bench before them: a driver compiles at the first draw
constexpr int pass_frames = 10;                // of --bench, in which each pass is waited for
constexpr std::size_t most_held_frames = 4096; // of --fps, remembered
constexpr double longest_s = 0.25; // a longer pause (a sleeping machine) does not move the show further
constexpr float volume_step = 0.1F;

assets::SceneFile load_scene(const std::filesystem::path &folder) {
    const std::filesystem::path path = folder / "scene.json";
    std::error_code unknown; // a name too long, a folder that may not be read: opening tells
    if (!std::filesystem::exists(path, unknown) && !unknown) {
        throw Error(path.string() +
                    ": there is no such file; `paradize bake SCENE.toml` writes a scene folder");
    }
    return assets::read_scene(path);
}

Device device() {
    Device out;
    out.software = gl::software_renderer();
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &out.most_texture_px);
    return out;
}

RenderSettings detail(const Options &options, const assets::SceneFile &file) {
    return options.reference ? reference_detail(file, *options.reference, device())
                             : detail_of(file, options.quality, device());
}

std::vector<QualityFeature> present_trades(const assets::SceneFile &file, const Device &device) {
    std::vector<QualityFeature> out;
    for (std::size_t i = 0; i < trade_count; ++i) {
        if (has_trade(file, static_cast<QualityFeature>(i), device)) {
            out.push_back(static_cast<QualityFeature>(i));
        }
    }
    return out;
}

/// What the player's trades err in this scene: `paradize measure` may have left it beside the folder, as
/// island.tradeoff.json beside island/.
std::vector<assets::TradeError> load_trades(const std::filesystem::path &folder) {
    std::filesystem::path path = std::filesystem::absolute(folder).lexically_normal();
    path = path.has_filename() ? path : path.parent_path();
    path += ".tradeoff.json";
    std::error_code unknown;
    if (!std::filesystem::exists(path, unknown)) {
        return {};
    }
    const assets::FileBytes file(path, {.most = assets::most_json_bytes});
    const auto bytes = file.bytes();
    return assets::parse_trades({reinterpret_cast<const char *>(bytes.data()), bytes.size()}, path);
}

/// Everything of one run that lives as long as the GL context.
class Show {
  public:
    /// rebaked: where scenes come from that replace the first; nullptr: none will.
    Show(const Options &options, ComingScene coming, const RendererSettings &settings,
         assets::SceneWatcher *rebaked)
        : options_(options), settings_(settings), acts_(std::move(coming), options.folder, rebaked),
          shaders_(gl::ShaderLibrary::find()),
          renderer_(std::make_unique<Renderer>(acts_.now().scene, shaders_, settings)) {
        tell_terrain();
        if (options.wait_resident || options.bench || options.fps ||
            (!options.screenshot.empty() && !options.frames)) {
            acts_.now().streamer.upload(std::numeric_limits<std::size_t>::max());
        }
        if (options.reference) {
            samples_ = reference_samples(*options.reference);
        }
        gl::demand_memory();
        if (options.fps) {
            hold_rate(*options.fps);
        }
    }

    /// Says once what a steered camera at this place goes beyond.
    void tell_steered(const glm::dvec3 &eye) { tell(baked_for_->steered(eye)); }

    const assets::SceneFile &file() const { return acts_.now().file; }
    Renderer &renderer() { return *renderer_; }
    std::vector<double> &frame_ms() { return frame_ms_; }

    /// A frame took so long until the device had finished it.
    void spent(double ms) {
        if (frame_ms_.size() < frame_ms_.capacity()) {
            frame_ms_.push_back(ms);
        }
        if (!governor_) {
            return;
        }
        held_ms_.push_back(ms);
        if (governor_->observe(ms)) {
            held_ms_.clear();
            apply(governor_->current().quality);
        }
        if (held_ms_.size() == most_held_frames) {
            held_ms_.erase(held_ms_.begin(), held_ms_.begin() + most_held_frames / 2);
        }
    }

    void measure_passes(double elapsed_s) {
        std::vector<std::vector<double>> times;
        for (int i = 0; i < pass_frames; ++i) {
            const double now_s = elapsed_s + i * frame_s;
            const auto passes = renderer_->measure_passes(now_s, flight_pose(file().flight, now_s));
            times.resize(passes.size());
            passes_ms_.clear();
            for (std::size_t p = 0; p < passes.size(); ++p) {
                times[p].push_back(passes[p].second);
                passes_ms_.emplace_back(passes[p].first, median(times[p]));
            }
        }
    }

    void frame(double elapsed_s, const Pose &pose, gl::DebugLog &log) {
        // Headless frames do not depend on the clock; those for the eye do not wait.
        tell(baked_for_->picture(renderer_->width_px(), renderer_->height_px()));
        const Unready unready = options_.headless ? Unready::wait : Unready::leave;
        if (LoadedScene *next = acts_.upload(upload_bytes_per_frame, unready)) {
            turn(*next, elapsed_s);
        }
        if (samples_.empty()) {
            renderer_->draw(elapsed_s, pose);
        } else {
            renderer_->draw_mean(elapsed_s, pose, samples_);
        }
        if (options_.debug) {
            log.demand_clean();
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
        out.bench = options_.bench;
        out.passes_ms = passes_ms_;
        out.quality = governor_ ? governor_->current().quality : options_.quality;
        out.trades = trades_;
        out.reference = options_.reference;
        if (governor_) {
            out.fps = FrameRate{*options_.fps,           governor_->current().quality,
                                governor_->current().ms, median(held_ms_.empty() ? frame_ms_ : held_ms_),
                                governor_->changes(),    calibration_.table};
        }
        out.resident_bytes = acts_.now().streamer.resident_bytes();
        out.total_bytes = acts_.now().streamer.total_bytes();
        out.terrain_bytes = acts_.now().streamer.terrain_bytes();
        out.terrain = renderer_->terrain_counts();
        out.renderer = gl::renderer_name();
        out.version = gl::version_name();
        out.screenshots = screenshots_;
        out.beyond = baked_for_->said();
        return out;
    }

  private:
    void apply(const Quality &quality) {
        settings_.detail = detail_of(file(), quality, device_);
        renderer_->set_detail(settings_.detail);
    }

    /// Measures, chooses, says what came of it.
    void hold_rate(double fps) {
        calibration_ =
            calibrate(*renderer_, file(), trades_, device_, options_.time_s, load_trades(options_.folder));
        governor_.emplace(quality_front(calibration_.table, trades_, calibration_.base_ms), 1000.0 / fps);
        held_ms_.reserve(most_held_frames);
        apply(governor_->current().quality);
        const std::string wanted = "--fps " + shortest(fps) + ": ";
        const std::string expected = fixed(governor_->current().ms, 3) + " ms";
        say(wanted + to_text(governor_->current().quality) + "; " + expected + " a frame are expected");
        if (governor_->out_of_reach()) {
            say(wanted + "a frame may take " + fixed(governor_->budget_ms(), 3) + " ms, and takes " +
                expected + " even at the cheapest qualities; give a smaller --size");
        }
    }

    static void tell(const std::string &text) {
        if (!text.empty()) {
            say(text);
        }
    }

    void tell_terrain() const { tell(terrain_warning(acts_.now().streamer.terrain_bytes())); }

    /// Shows a new scene from here on. The moment of the show and its camera stay.
    void turn(LoadedScene &next, double elapsed_s) {
        const std::uint64_t terrain_bytes = acts_.now().streamer.terrain_bytes();
        settings_.width_px = renderer_->width_px();
        settings_.height_px = renderer_->height_px();
        settings_.detail = governor_ ? detail_of(next.file, governor_->current().quality, device_)
                                     : detail(options_, next.file);
        try {
            auto renderer = std::make_unique<Renderer>(next.scene, shaders_, settings_);
            gl::demand_memory();
            renderer->go_on(*renderer_);
            const std::unique_ptr<LoadedScene> before = acts_.turn();
            renderer_ = std::move(renderer); // the one before ends here, and then its act
            baked_for_ = std::make_unique<BakeLimits>(file());
        } catch (const Error &error) {
            acts_.refuse(error.what());
            return;
        }
        if (acts_.now().streamer.terrain_bytes() > terrain_bytes) {
            tell_terrain();
        }
        const std::size_t all = file().artifacts.size();
        say("scene.json was replaced: " + std::to_string(all - acts_.now().streamer.kept()) + " of " +
            std::to_string(all) + " artifacts are new; shown from second " + fixed(elapsed_s, 3) + " on");
    }

    const Options &options_;
    RendererSettings settings_;
    SceneSwap acts_;
    std::unique_ptr<BakeLimits> baked_for_ = std::make_unique<BakeLimits>(file());
    gl::ShaderLibrary shaders_;
    std::unique_ptr<Renderer> renderer_;
    std::vector<Sample> samples_; // of --reference; else none
    std::vector<double> frame_ms_;
    std::vector<std::uint8_t> pixels_;
    std::vector<std::string> screenshots_;
    Device device_ = device();
    std::vector<QualityFeature> trades_ = present_trades(file(), device_);
    Calibration calibration_; // of --fps; as are the next
    std::optional<FrameGovernor> governor_;
    std::vector<double> held_ms_; // frames since the last change
    std::vector<std::pair<std::string, double>> passes_ms_;
};

/// poster.png -> poster_0007.png
std::filesystem::path numbered(const std::filesystem::path &path, int number) {
    char digits[16];
    std::snprintf(digits, sizeof digits, "_%04d", number);
    std::filesystem::path out = path;
    out.replace_filename(path.stem().string() + digits + path.extension().string());
    return out;
}

/// A fixed number of frames, 1/30 s apart.
void play_frames(Show &show, const Options &options, gl::DebugLog &log, Window *window) {
    const int before = options.bench ? unmeasured_frames : 0;
    const int frames = before + options.frames.value_or(options.bench ? bench_frames : 1);
    show.frame_ms().reserve(static_cast<std::size_t>(frames));
    for (int i = 0; i < frames; ++i) {
        const double elapsed_s = options.time_s + i * frame_s;
        if (options.bench) {
            glFinish(); // what a window still does of the last frame
        }
        const double start = now_ms();
        show.frame(elapsed_s, flight_pose(show.file().flight, elapsed_s), log);
        glFinish();
        if (i >= before) {
            show.spent(now_ms() - start);
        }
        if (!options.screenshot.empty()) {
            show.save(options.frames ? numbered(options.screenshot, i) : options.screenshot);
        }
        if (window != nullptr) {
            int width = 0;
            int height = 0;
            window->size(width, height);
            gl::blit_color(show.renderer().output(), show.renderer().width_px(), show.renderer().height_px(),
                           0, width, height);
            window->swap();
            const Input input = window->poll();
            if (input.close || input.any_key) {
                return;
            }
        }
    }
}

/// Plays the scene's sound; one that is played already goes on.
void start_sound(const assets::SceneFile &file, const Options &options, Audio &audio, std::string &heard,
                 bool &muted) {
    const assets::Artifact *sound = file.sound ? file.find_artifact(file.sound->artifact) : nullptr;
    if (sound == nullptr) {
        audio.stop();
        heard.clear();
        return;
    }
    if (options.mute || (sound->sha256 == heard && !heard.empty())) {
        return;
    }
    heard = sound->sha256;
    try {
        const assets::FileBytes bytes = assets::read_artifact(*sound, options.folder);
        muted = !audio.load(bytes.bytes(), sound->file);
    } catch (const Error &error) { // it was right when the scene was opened
        say(std::string("no sound: ") + error.what());
        audio.stop();
        muted = true;
    }
    audio.set_volume(file.sound->volume);
    audio.play();
}

/// Until a key, Escape or the window's button ends it.
void play_window(Show &show, const Options &options, gl::DebugLog &log, Window &window) {
    Audio audio;
    bool muted = true;
    std::string heard; // SHA-256
    start_sound(show.file(), options, audio, heard, muted);
    show.frame_ms().reserve(1U << 20U);
    FreeCamera camera(flight_pose(show.file().flight, options.time_s));
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
        const double delta_s = std::clamp(now_s - last_s, 0.0, longest_s);
        last_s = now_s;
        if (options.interactive) {
            camera.move(input, delta_s);
            show.tell_steered(camera.pose().eye);
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
            show.renderer().resize(width, height);
        }
        const double start = now_ms();
        const assets::SceneFile *shown = &show.file();
        show.frame(elapsed_s,
                   options.interactive ? camera.pose() : flight_pose(show.file().flight, elapsed_s), log);
        gl::blit_color(show.renderer().output(), show.renderer().width_px(), show.renderer().height_px(), 0,
                       width, height);
        if (options.fps) {
            glFinish(); // what is held is the drawing, not the wait for the screen
            show.spent(now_ms() - start);
        }
        window.swap();
        if (shown != &show.file()) {
            start_sound(show.file(), options, audio, heard, muted);
        }
        if (!options.fps) {
            show.spent(now_ms() - start);
        }
    }
}

} // namespace

int run(const Options &options) {
    const bool counted = options.headless || options.bench || options.frames || !options.screenshot.empty();
    std::optional<assets::SceneWatcher> rebaked; // before scene.json is read, so that none is missed
    if (!options.bench && !options.reference && (!counted || options.frames)) {
        rebaked.emplace(options.folder / "scene.json");
    }
    // Its files are read while the context is made.
    ComingScene coming(load_scene(options.folder), options.folder);
    const assets::SceneFile &file = *coming.file;
    RendererSettings settings;
    settings.width_px = options.width_px.value_or(file.width_px);
    settings.height_px = options.height_px.value_or(file.height_px);
    settings.disabled = options.disabled;

    std::unique_ptr<gl::HeadlessContext> headless;
    std::unique_ptr<Window> window;
    if (options.headless) {
        headless = std::make_unique<gl::HeadlessContext>(options.debug);
    } else {
        window = std::make_unique<Window>(Window::Settings{printable(file.name), settings.width_px,
                                                           settings.height_px, options.screenshot.empty(),
                                                           options.interactive, options.debug});
    }
    settings.detail = detail(options, file);
    gl::DebugLog log;
    if (options.debug) {
        log.install();
    }
    Show show(options, std::move(coming), settings, rebaked ? &*rebaked : nullptr);
    if (options.debug) {
        log.demand_clean();
    }
    if (counted) {
        play_frames(show, options, log, window.get());
    } else {
        play_window(show, options, log, *window);
    }
    if (options.bench) {
        show.measure_passes(options.time_s);
    }
    if (options.json) {
        print(to_json(show.report()) + "\n");
    } else if (options.bench) {
        print(bench_line(show.report()) + "\n");
    } else if (options.fps) {
        print(fps_line(*show.report().fps) + "\n");
    }
    return 0;
}

} // namespace paradize
