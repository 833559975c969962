#pragma once
// One looping sound. Nothing here throws. Without a device or a file, playback is silent and logs one
// message.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace paradize {

struct SoundSamples {
    std::vector<std::int16_t> samples; // channels interleaved; clipped to full scale
    int channels = 1;                  // 1 or 2
    int rate_hz = 0;                   // samples per second of one channel
};

/// Decodes the bytes of any file that libsndfile reads. Returns what went wrong, or nullptr.
const char *read_sound(std::span<const std::byte> bytes, SoundSamples &out);

class Audio {
  public:
    Audio() noexcept;
    ~Audio();
    Audio(const Audio &) = delete;
    Audio &operator=(const Audio &) = delete;

    /// Opens the default device and decodes the bytes of a mono or stereo file that libsndfile reads. On
    /// failure it returns false and logs one message that contains `name`.
    bool load(std::span<const std::byte> bytes, const std::string &name);
    /// Plays in a loop from the current position. After stop() it plays from the beginning.
    void play();
    void pause();
    void stop();
    /// 0 is silent, 1 is the recorded volume. Values outside [0, 1] are clamped.
    void set_volume(float volume);
    float volume() const;
    bool playing() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace paradize
