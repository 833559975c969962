#include "app/run.hpp"

#include "app/messages.hpp"
#include "app/play_frames.hpp"
#include "app/play_window.hpp"
#include "app/sound_file.hpp"
#include "app/stop.hpp"
#include "app/window.hpp"
#include "assets/watcher.hpp"
#include "error.hpp"
#include "gl/debug.hpp"
#include "gl/device_memory.hpp"
#include "gl/headless.hpp"
#include "gl/uniform_check.hpp"

#include <cmath>
#include <memory>
#include <optional>
#include <utility>

namespace paradize {

namespace {

assets::SceneFile load_scene(const std::filesystem::path &folder) {
    const std::filesystem::path path = folder / "scene.json";
    std::error_code unknown; // errors other than a missing file are reported when the file is opened
    if (!std::filesystem::exists(path, unknown) && !unknown) {
        throw Error(path.string() +
                    ": there is no such file; `paradize bake SCENE.toml` writes a scene folder");
    }
    return assets::read_scene(path);
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
    assets::SceneFile scene = load_scene(options.folder);
    if (!options.audio.empty()) {
        const int all = static_cast<int>(std::ceil(scene.flight.duration_s / frame_s));
        const int frames = options.frames.value_or(options.screenshot.empty() ? all : 1);
        write_flight_sound(scene, options.folder, options.time_s, frames, options.audio);
        if (options.screenshot.empty() || stop_signal() != 0) {
            return 0;
        }
    }
    // Threads read the files while the GL context is created.
    PendingScene pending(std::move(scene), options.folder, memory_limits(options));
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
    gl::keep_deleted_memory();
    renderer_options.settings = chosen_settings(options, file);
    gl::DebugLog log;
    if (options.debug) {
        log.install();
        gl::check_uniforms();
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
    if (stop_signal() != 0) {
        return 0; // main() ends by the signal; the figures of a part are none
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
