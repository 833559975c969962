#pragma once
// Plays a fixed number of frames: --frames, --bench, --screenshot.

#include "app/playback.hpp"

namespace paradize {

/// Draws frames 1/30 s apart, until all are drawn or a key ends playback. `window`: nullptr if headless.
void play_frames(Playback &playback, const Options &options, gl::DebugLog &log, Window *window);

} // namespace paradize
