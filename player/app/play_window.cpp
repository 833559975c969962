#include "app/play_window.hpp"

#include "app/audio.hpp"
#include "app/free_camera.hpp"
#include "app/stop.hpp"
#include "app/window.hpp"
#include "gl/framebuffer.hpp"

#include <epoxy/gl.h>

#include <algorithm>

namespace paradize {

namespace {

// upper limit of a time step, so that a suspended machine does not skip ahead
constexpr double max_delta_s = 0.25;
constexpr float volume_step = 0.1F;

} // namespace

void play_window(Playback &playback, const Options &options, gl::DebugLog &log, Window &window) {
    Audio audio;
    const auto load_sounds = [&] {
        if (!options.mute) {
            audio.load(playback.file(), options.folder);
        }
    };
    load_sounds();
    playback.reserve_frames(1U << 20U);
    FreeCamera camera(flight_pose(playback.file().flight, options.time_s));
    double elapsed_s = options.time_s;
    double last_s = window.seconds();
    bool paused = false;
    while (stop_signal() == 0) {
        const Input input = window.poll();
        if (input.close || (options.interactive ? input.escape : input.any_key)) {
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
                audio.set_muted(!audio.muted());
            }
            if (input.next_music) {
                audio.next_music();
            }
            if (input.volume_steps != 0) {
                audio.set_volume(audio.volume() + volume_step * static_cast<float>(input.volume_steps));
            }
        }
        elapsed_s += paused ? 0.0 : delta_s;
        audio.update(options.interactive ? camera.pose() : flight_pose(playback.file().flight, elapsed_s),
                     elapsed_s, delta_s);
        paused ? audio.pause() : audio.play(elapsed_s);
        if (window.minimised()) { // nobody sees a frame
            window.wait();
            continue;
        }
        int width = 0;
        int height = 0;
        window.size(width, height);
        playback.renderer().resize(width, height);
        const double start = now_ms();
        const assets::SceneFile *shown = &playback.file();
        playback.frame(elapsed_s,
                       options.interactive
                           ? playback.steered_forecast(camera.pose(), before, elapsed_s, delta_s)
                           : playback.flight_forecast(elapsed_s),
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
            load_sounds();
        }
        if (!options.fps) {
            playback.record_frame_time(now_ms() - start);
        }
    }
}

} // namespace paradize
