#pragma once
// One looping sound. Nothing here throws: without a device or a file the show is silent, and says so once.

#include <filesystem>
#include <memory>

namespace paradize {

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
