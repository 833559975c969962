#pragma once
// The whole run: loads a scene and plays it, in a window or headless.

#include "app/options.hpp"

namespace paradize {

/// Returns the exit code 0; throws Error.
int run(const Options &options);

} // namespace paradize
