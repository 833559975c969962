#pragma once
// One looping sound. Nothing here throws: without a device or a file the show is silent, and says so once.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

namespace paradize {

struct SoundSamples {
    std::vector<std::int16_t> samples; // channels interleaved; what is louder than full scale is clipped
    int channels = 1;                  // 1 or 2
    int per_s = 0;                     // samples of one channel in a second
};

/// Decodes a whole file that libsndfile reads. What went wrong, or nullptr.
const char *read_sound(const std::filesystem::path &file, SoundSamples &out);

class Audio {
  public:
    Audio() noexcept;
    ~Audio();
    Audio(const Audio &) = delete;
    Audio &operator=(const Audio &) = delete;

    /// Opens the default device and loads a file that libsndfile reads (mono or stereo). False, with one
    /// message on standard error, when that fails.
    bool load(const std::filesystem::path &file);
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
