#pragma once
// One looping sound. Nothing here throws: without a device or a file the show is silent, and says so once.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace paradize {

struct SoundSamples {
    std::vector<std::int16_t> samples; // channels interleaved; what is louder than full scale is clipped
    int channels = 1;                  // 1 or 2
    int rate_hz = 0;                   // samples of one channel in a second
};

/// Decodes a file that libsndfile reads, given as its bytes. What went wrong, or nullptr.
const char *read_sound(std::span<const std::byte> bytes, SoundSamples &out);

class Audio {
  public:
    Audio() noexcept;
    ~Audio();
    Audio(const Audio &) = delete;
    Audio &operator=(const Audio &) = delete;

    /// Opens the default device and decodes a file that libsndfile reads (mono or stereo), given as its
    /// bytes. False, with one message on standard error that has its `name`, when that fails.
    bool load(std::span<const std::byte> bytes, const std::string &name);
    /// Plays from where it is, looping; after stop() from the beginning.
    void play();
    void pause();
    void stop();
    /// 0 silent to 1 as recorded; clamped.
    void set_volume(float volume);
    float volume() const;
    bool playing() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace paradize
