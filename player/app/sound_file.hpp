#pragma once
// Writes what a flight sounds like into a WAV file, as the window would play it, without a sound device.

#include "assets/scene/file.hpp"

#include <filesystem>

namespace paradize {

/// Writes the sound of `frames` frames of the flight from `time_s` on, 1/30 s each: stereo, 16 bit, 44,100
/// samples a second. Throws Error if the file cannot be written or a sound cannot be played.
void write_flight_sound(const assets::SceneFile &scene, const std::filesystem::path &folder, double time_s,
                        int frames, const std::filesystem::path &path);

} // namespace paradize
