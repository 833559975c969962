#pragma once
// Timestamps of the device (GL_TIMESTAMP, core since 3.3).

#include "gl/handle.hpp"

#include <cstdint>

namespace paradize::gl {

/// True if the device's timestamps tell when it has done its work. A software rasteriser's do not: it draws
/// later than it says.
bool has_timestamps();
/// Asks for the time at which the device has finished all commands before this one.
void ask_timestamp(const Query &query);
/// Waits for the answer, nanoseconds.
std::uint64_t read_timestamp(const Query &query);

} // namespace paradize::gl
