#include "show.hpp"

#include "acts.hpp"
#include "assets/rebaked.hpp"
#include "assets/scene_file.hpp"
#include "audio.hpp"
#include "error.hpp"
#include "free_camera.hpp"
#include "gl/debug.hpp"
#include "gl/framebuffer.hpp"
#include "gl/headless.hpp"
#include "gl/shader_library.hpp"
#include "png.hpp"
#include "renderer.hpp"
#include "report.hpp"
#include "window.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

namespace paradize {

namespace {

constexpr std::size_t upload_bytes_per_frame = std::size_t{4} << 20U;
constexpr double frame_s = 1.0 / 30.0; // between the frames of --frames
constexpr int bench_frames = 100;      // of --bench, unless --frames says otherwise
constexpr int unmeasured_frames = 5;   // of --bench before them: a driver compiles at the first draw
constexpr double longest_s = 0.25;     // a longer pause (a sleeping machine) does not move the show further
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

double now_ms() {
    using namespace std::chrono;
    return duration<double, std::milli>(steady_clock::now().time_since_epoch()).count();
}

/// Everything of one run that lives as long as the GL context.
class Show {
  public:
    /// rebaked: where scenes come from that replace the first; nullptr: none will.
    Show(const Options &options, assets::SceneFile file, const RendererSettings &settings,
         assets::Rebaked *rebaked)
        : options_(options), settings_(settings), acts_(std::move(file), options.folder, rebaked),
          shaders_(gl::ShaderLibrary::find()),
          renderer_(std::make_unique<Renderer>(acts_.now().scene, shaders_, settings)) {
        tell_terrain();
        if (options.wait_resident || options.bench || (!options.screenshot.empty() && !options.frames)) {
            acts_.now().streamer.upload(std::numeric_limits<std::size_t>::max());
        }
        gl::demand_memory();
    }

    /// Says once, where a picture is taller than those that the bake was made for, what it lacks.
    void tell_height(int height_px) {
        if (told_ || !file().terrain || file().terrain->left_out == 0 || height_px <= file().height_px) {
            return;
        }
        told_ = true;
        std::fprintf(
            stderr,
            "paradize-player: the picture is %d pixels high, the scene was baked for %d: finer patches "
            "of the terrain were not baked; raise `viewport` in the scene and bake it again\n",
            height_px, file().height_px);
    }

    const assets::SceneFile &file() const { return acts_.now().file; }
    Renderer &renderer() { return *renderer_; }
    std::vector<double> &frame_ms() { return frame_ms_; }

    void frame(double elapsed_s, const Pose &pose, gl::DebugLog &log) {
        // Headless frames do not depend on the clock; those for the eye do not wait.
        tell_height(renderer_->height_px());
        const Unready unready = options_.headless ? Unready::wait : Unready::leave;
        if (Act *next = acts_.upload(upload_bytes_per_frame, unready)) {
            turn(*next, elapsed_s);
        }
        renderer_->draw(elapsed_s, pose);
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
        out.resident_bytes = acts_.now().streamer.resident_bytes();
        out.total_bytes = acts_.now().streamer.total_bytes();
        out.terrain_bytes = acts_.now().streamer.terrain_bytes();
        out.terrain = renderer_->terrain_counts();
        out.renderer = gl::renderer_name();
        out.version = gl::version_name();
        out.screenshots = screenshots_;
        return out;
    }

  private:
    void tell_terrain() const {
        const std::string warning = terrain_warning(acts_.now().streamer.terrain_bytes());
        if (!warning.empty()) {
            std::fprintf(stderr, "paradize-player: %s\n", warning.c_str());
        }
    }

    /// Shows a new scene from here on. The moment of the show and its camera stay.
    void turn(Act &next, double elapsed_s) {
        const std::uint64_t terrain_bytes = acts_.now().streamer.terrain_bytes();
        settings_.width_px = renderer_->width_px();
        settings_.height_px = renderer_->height_px();
        try {
            auto renderer = std::make_unique<Renderer>(next.scene, shaders_, settings_);
            gl::demand_memory();
            renderer->go_on(*renderer_);
            const std::unique_ptr<Act> before = acts_.turn();
            renderer_ = std::move(renderer); // the one before ends here, and then its act
        } catch (const Error &error) {
            acts_.refuse(error.what());
            return;
        }
        if (acts_.now().streamer.terrain_bytes() > terrain_bytes) {
            tell_terrain();
        }
        const std::size_t all = file().artifacts.size();
        std::fprintf(stderr,
                     "paradize-player: scene.json was replaced: %zu of %zu artifacts are new; shown from "
                     "second %.3f on\n",
                     all - acts_.now().streamer.kept(), all, elapsed_s);
    }

    const Options &options_;
    RendererSettings settings_;
    Acts acts_;
    gl::ShaderLibrary shaders_;
    std::unique_ptr<Renderer> renderer_;
    std::vector<double> frame_ms_;
    std::vector<std::uint8_t> pixels_;
    std::vector<std::string> screenshots_;
    bool told_ = false;
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
            show.frame_ms().push_back(now_ms() - start);
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
    muted = !audio.load(options.folder / sound->file);
    heard = sound->sha256;
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
        window.swap();
        if (shown != &show.file()) {
            start_sound(show.file(), options, audio, heard, muted);
        }
        if (show.frame_ms().size() < show.frame_ms().capacity()) {
            show.frame_ms().push_back(now_ms() - start);
        }
    }
}

} // namespace

int run(const Options &options) {
    const bool counted = options.headless || options.bench || options.frames || !options.screenshot.empty();
    std::optional<assets::Rebaked> rebaked; // before scene.json is read, so that none is missed
    if (!options.bench && (!counted || options.frames)) {
        rebaked.emplace(options.folder / "scene.json");
    }
    assets::SceneFile file = load_scene(options.folder);
    RendererSettings settings;
    settings.width_px = options.width_px.value_or(file.width_px);
    settings.height_px = options.height_px.value_or(file.height_px);
    settings.disabled = options.disabled;

    std::unique_ptr<gl::HeadlessContext> headless;
    std::unique_ptr<Window> window;
    if (options.headless) {
        headless = std::make_unique<gl::HeadlessContext>(options.debug);
    } else {
        window = std::make_unique<Window>(Window::Settings{file.name, settings.width_px, settings.height_px,
                                                           options.screenshot.empty(), options.interactive,
                                                           options.debug});
    }
    gl::DebugLog log;
    if (options.debug) {
        log.install();
    }
    Show show(options, std::move(file), settings, rebaked ? &*rebaked : nullptr);
    if (options.debug) {
        log.demand_clean();
    }
    if (counted) {
        play_frames(show, options, log, window.get());
    } else {
        play_window(show, options, log, *window);
    }
    if (options.json) {
        print(to_json(show.report()) + "\n");
    } else if (options.bench) {
        print(bench_line(show.report()) + "\n");
    }
    return 0;
}

} // namespace paradize
