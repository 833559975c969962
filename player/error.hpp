#pragma once
// The player's exception: thrown while loading, caught in main().

#include <stdexcept>
#include <string>

namespace paradize {

/// A message of one or a few lines: file, place, value, limit and remedy.
class Error : public std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// The end of a message about a baked file that is damaged or not as the bake wrote it.
inline constexpr const char *bake_again = "; bake the scene again: paradize bake SCENE.toml";

/// A message about a baked file with that end, where it has no such remedy yet.
inline std::string with_bake_again(const std::string &what) {
    return what.find("bake the scene") == std::string::npos ? what + bake_again : what;
}

} // namespace paradize
