#pragma once
// Plays in a window, with sound, keys and mouse.

#include "app/playback.hpp"

namespace paradize {

/// Runs until a key, Escape or the close button ends playback.
void play_window(Playback &playback, const Options &options, gl::DebugLog &log, Window &window);

} // namespace paradize
