#include "app/play_frames.hpp"

#include "app/stop.hpp"
#include "app/window.hpp"
#include "gl/framebuffer.hpp"

#include <epoxy/gl.h>

#include <cstdio>

namespace paradize {

namespace {

constexpr int bench_frames = 100; // measured frames of --bench; --frames overrides it
constexpr int warm_up_frames = 5; // untimed frames before them: drivers compile shaders at the first draw

/// poster.png -> poster_0007.png
std::filesystem::path numbered(const std::filesystem::path &path, int number) {
    char digits[16];
    std::snprintf(digits, sizeof digits, "_%04d", number);
    std::filesystem::path out = path;
    out.replace_filename(path.stem().string() + digits + path.extension().string());
    return out;
}

} // namespace

void play_frames(Playback &playback, const Options &options, gl::DebugLog &log, Window *window) {
    const int before = options.bench ? warm_up_frames : 0;
    const int frames = before + options.frames.value_or(options.bench ? bench_frames : 1);
    playback.reserve_frames(static_cast<std::size_t>(frames));
    for (int i = 0; i < frames; ++i) {
        if (stop_signal() != 0) {
            return;
        }
        const double elapsed_s = options.time_s + i * frame_s;
        if (options.bench) {
            glFinish(); // finishes the window's previous frame
        }
        const double start = now_ms();
        playback.frame(elapsed_s, playback.flight_forecast(elapsed_s), log);
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

} // namespace paradize
