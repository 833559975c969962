#include "app/play_window.hpp"

#include "app/audio.hpp"
#include "app/free_camera.hpp"
#include "app/messages.hpp"
#include "app/window.hpp"
#include "assets/loaded_artifact.hpp"
#include "error.hpp"
#include "gl/framebuffer.hpp"

#include <epoxy/gl.h>

#include <algorithm>

namespace paradize {

namespace {

// upper limit of a time step, so that a suspended machine does not skip ahead
constexpr double max_delta_s = 0.25;
constexpr float volume_step = 0.1F;

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

} // namespace

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

} // namespace paradize
