#pragma once
// The one exception of the player: thrown while loading, caught in main.

#include <stdexcept>

namespace paradize {

/// What went wrong, with file, place, value and mend in one message of one line or a few.
class Error : public std::runtime_error {
    using std::runtime_error::runtime_error;
};

} // namespace paradize
