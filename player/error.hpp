#pragma once
// The player's exception: thrown while loading, caught in main().

#include <stdexcept>

namespace paradize {

/// A message of one or a few lines: file, place, value, limit and remedy.
class Error : public std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// The end of a message about a baked file that is damaged or not as the bake wrote it.
inline constexpr const char *bake_again = "; bake the scene again: paradize bake SCENE.toml";

} // namespace paradize
