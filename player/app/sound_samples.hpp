#pragma once
// Decodes the bytes of a sound file.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace paradize {

struct SoundSamples {
    std::vector<std::int16_t> samples; // channels interleaved; clipped to full scale
    int channels = 1;                  // 1 or 2
    int rate_hz = 0;                   // samples per second of one channel

    std::size_t frames() const { return samples.size() / static_cast<std::size_t>(channels); }
};

/// Decodes the bytes of any file that libsndfile reads. Returns what went wrong, or nullptr.
const char *read_sound(std::span<const std::byte> bytes, SoundSamples &out);

/// The mean of both channels.
SoundSamples to_mono(const SoundSamples &sound);
/// One channel, twice.
SoundSamples to_stereo(const SoundSamples &sound);

} // namespace paradize
