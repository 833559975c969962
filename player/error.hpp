#pragma once
// The one exception of the player: thrown while loading, caught in main.

#include <stdexcept>

namespace paradize {

/// What went wrong, with file, place, value and mend in one message of one line or a few.
class Error : public std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// What mends a file that a bake wrote and that is not as it wrote it: the end of a message.
inline constexpr const char *bake_again = "; bake the scene again: paradize bake SCENE.toml";

} // namespace paradize
