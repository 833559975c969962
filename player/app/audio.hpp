#pragma once
// Plays the sounds and the music of a scene. Nothing here throws. What cannot be played is silent, with one
// message.

#include "assets/scene/file.hpp"
#include "scene/flight.hpp"

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>

namespace paradize {

inline constexpr int audio_rate_hz = 44100; // of AudioOutput::memory

/// The default device, or blocks of samples that Audio::render returns.
enum class AudioOutput { device, memory };

class Audio {
  public:
    explicit Audio(AudioOutput output = AudioOutput::device) noexcept;
    ~Audio();
    Audio(const Audio &) = delete;
    Audio &operator=(const Audio &) = delete;

    /// Takes the sounds of a scene instead of those before; what is the same goes on. `folder`: the scene's.
    /// Returns true if all of them can be played.
    bool load(const assets::SceneFile &scene, const std::filesystem::path &folder);
    /// Plays all sounds, each from the place in its loop that it has at `elapsed_s`.
    void play(double elapsed_s) noexcept;
    void pause() noexcept;
    void clear() noexcept;
    /// Places all sounds as the pose hears them. Call it in each frame, and before play(). `delta_s` since
    /// the last call: the music fades.
    void update(const Pose &pose, double elapsed_s, double delta_s) noexcept;
    /// The next piece of music; none after the last.
    void next_music() noexcept;
    /// The piece that plays: 1 is the first; 0: none.
    int music() const;
    /// 0 is silent, 1 is the recorded volume. Values outside [0, 1] are clamped.
    void set_volume(float volume) noexcept;
    float volume() const;
    void set_muted(bool muted) noexcept;
    bool muted() const;
    /// Sounds and pieces of music that are playing, silent ones too.
    std::size_t playing() const;
    /// Of AudioOutput::memory: writes what is heard next, left and right interleaved. False without sounds.
    bool render(std::span<float> out) noexcept;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace paradize
