#pragma once
// Loads a scene and plays it, in a window or headless.

#include "app/options.hpp"

namespace paradize {

/// Runs the player. Returns exit code 0, or throws Error.
int run(const Options &options);

} // namespace paradize
