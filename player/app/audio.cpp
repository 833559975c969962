#include "app/audio.hpp"

#include "app/messages.hpp"
#include "app/sound_samples.hpp"
#include "assets/loaded_artifact.hpp"
#include "error.hpp"
#include "scene/sound_field.hpp"

#include <AL/al.h>
#include <AL/alc.h>
#include <AL/alext.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace paradize {

namespace {

constexpr double music_fade_s = 1.5;
constexpr float most_direct = 0.8F; // sounds from one side reach the other ear as well: 18 dB quieter
constexpr float pi = 3.14159265F;

} // namespace

namespace openal {

struct CloseDevice {
    void operator()(ALCdevice *device) const { alcCloseDevice(device); }
};
struct CloseContext {
    void operator()(ALCcontext *context) const {
        alcMakeContextCurrent(nullptr);
        alcDestroyContext(context);
    }
};

/// The samples of a loop on the device.
class Buffer {
  public:
    explicit Buffer(const SoundSamples &sound) : frames_(sound.frames()), rate_hz_(sound.rate_hz) {
        alGenBuffers(1, &name_);
        alBufferData(name_, sound.channels == 1 ? AL_FORMAT_MONO16 : AL_FORMAT_STEREO16, sound.samples.data(),
                     static_cast<ALsizei>(sound.samples.size() * sizeof(std::int16_t)), sound.rate_hz);
    }
    ~Buffer() { alDeleteBuffers(1, &name_); }
    Buffer(const Buffer &) = delete;
    Buffer &operator=(const Buffer &) = delete;

    ALuint name() const { return name_; }
    /// The frame of the loop at a second since the scene began.
    ALint frame_at(double elapsed_s) const {
        const double count = static_cast<double>(frames_);
        const double frame = std::floor(std::fmod(std::max(elapsed_s, 0.0) * rate_hz_, count));
        return static_cast<ALint>(std::min(frame, count - 1.0));
    }

  private:
    ALuint name_ = 0;
    std::size_t frames_;
    int rate_hz_;
};

/// A buffer that plays.
class Voice {
  public:
    Voice(std::string key, std::shared_ptr<const Buffer> buffer)
        : key_(std::move(key)), buffer_(std::move(buffer)) {
        alGenSources(1, &source_);
        alSourcei(source_, AL_BUFFER, static_cast<ALint>(buffer_->name()));
        alSourcei(source_, AL_LOOPING, AL_TRUE);
        alSourcei(source_, AL_SOURCE_RELATIVE, AL_TRUE);
        alSourcei(source_, AL_DIRECT_CHANNELS_SOFT, AL_TRUE); // two channels: as they were recorded
        alSourcef(source_, AL_GAIN, 0.0F);
    }
    ~Voice() { alDeleteSources(1, &source_); }
    Voice(const Voice &) = delete;
    Voice &operator=(const Voice &) = delete;

    const std::string &key() const { return key_; }

    void set_gain(float gain) const { alSourcef(source_, AL_GAIN, gain); }

    /// A sound with one channel comes from `direction`, whose length is 1 for one direction and 0 for all.
    /// The device pans a source that fills a cap of the sphere; the mean direction over a cap of half angle a
    /// has the length (1 + cos a) / 2.
    void set_direction(const glm::vec3 &direction) const {
        const float length = most_direct * glm::length(direction);
        const glm::vec3 unit = length > 1e-4F ? glm::normalize(direction) : glm::vec3(0.0F, 0.0F, -1.0F);
        const float half_angle = std::acos(std::clamp(2.0F * length - 1.0F, -1.0F, 1.0F));
        // OpenAL Soft's radius of a source at distance 1 whose cap has this half angle
        const float radius =
            2.0F * half_angle <= pi ? std::sin(half_angle) : pi / std::max(2.0F * (pi - half_angle), 1e-3F);
        alSourcei(source_, AL_DIRECT_CHANNELS_SOFT, AL_FALSE);
        alSource3f(source_, AL_POSITION, unit.x, unit.y, unit.z);
        alSourcef(source_, AL_SOURCE_RADIUS, radius);
    }

    void play(double elapsed_s) const {
        if (!playing()) {
            alSourcei(source_, AL_SAMPLE_OFFSET, buffer_->frame_at(elapsed_s));
            alSourcePlay(source_);
        }
    }
    void pause() const { alSourcePause(source_); }
    bool playing() const {
        ALint state = AL_STOPPED;
        alGetSourcei(source_, AL_SOURCE_STATE, &state);
        return state == AL_PLAYING;
    }

  private:
    std::string key_; // equal keys: the same samples
    std::shared_ptr<const Buffer> buffer_;
    ALuint source_ = 0;
};

} // namespace openal

struct Audio::Impl {
    AudioOutput output;
    std::unique_ptr<ALCdevice, openal::CloseDevice> device;
    std::unique_ptr<ALCcontext, openal::CloseContext> context;
    LPALCRENDERSAMPLESSOFT render_samples = nullptr;
    // of the scene; a sound that cannot be played has no voice
    std::vector<std::pair<assets::Sound, std::unique_ptr<openal::Voice>>> sounds;
    std::vector<std::unique_ptr<openal::Voice>> pieces;
    std::vector<double> piece_gains; // they move towards 0 or 1
    float music_volume = 0.0F;
    double duration_s = 1.0;
    int music = 0;
    bool has_scene = false;
    float volume = 1.0F;
    bool muted = false;

    /// Returns what went wrong, or nullptr.
    const char *open() {
        if (context) {
            return nullptr;
        }
        std::array<ALCint, 11> attributes{};
        if (output == AudioOutput::memory) {
            const auto open_loopback = reinterpret_cast<LPALCLOOPBACKOPENDEVICESOFT>(
                alcGetProcAddress(nullptr, "alcLoopbackOpenDeviceSOFT"));
            render_samples =
                reinterpret_cast<LPALCRENDERSAMPLESSOFT>(alcGetProcAddress(nullptr, "alcRenderSamplesSOFT"));
            if (alcIsExtensionPresent(nullptr, "ALC_SOFT_loopback") != ALC_TRUE || open_loopback == nullptr ||
                render_samples == nullptr) {
                return "this OpenAL cannot render to memory";
            }
            attributes = {ALC_FORMAT_CHANNELS_SOFT,
                          ALC_STEREO_SOFT,
                          ALC_FORMAT_TYPE_SOFT,
                          ALC_FLOAT_SOFT,
                          ALC_FREQUENCY,
                          audio_rate_hz,
                          ALC_HRTF_SOFT,
                          ALC_FALSE,
                          ALC_OUTPUT_LIMITER_SOFT,
                          ALC_FALSE,
                          0};
            device.reset(open_loopback(nullptr));
        } else {
            device.reset(alcOpenDevice(nullptr));
        }
        if (!device) {
            return "there is no sound device";
        }
        context.reset(alcCreateContext(device.get(), attributes[0] != 0 ? attributes.data() : nullptr));
        if (!context || alcMakeContextCurrent(context.get()) != ALC_TRUE) {
            context.reset();
            return "the sound device offers no context";
        }
        alDistanceModel(AL_NONE); // hear() knows the distances
        set_listener();
        return nullptr;
    }

    void set_listener() const {
        if (context) {
            alListenerf(AL_GAIN, muted ? 0.0F : volume);
        }
    }

    template <typename Each>
    void for_each_voice(const Each &each) const {
        for (const auto &[sound, voice] : sounds) {
            if (voice) {
                each(*voice);
            }
        }
        for (const std::unique_ptr<openal::Voice> &piece : pieces) {
            if (piece) {
                each(*piece);
            }
        }
    }

    void place(const Pose &pose, double elapsed_s) {
        for (const auto &[sound, voice] : sounds) {
            if (voice) {
                const HeardSound heard = hear(sound, pose, elapsed_s, duration_s);
                voice->set_gain(heard.gain * sound.volume);
                if (!sound.places.empty()) {
                    voice->set_direction(heard.direction);
                }
            }
        }
        for (std::size_t i = 0; i < pieces.size(); ++i) {
            if (pieces[i]) {
                pieces[i]->set_gain(music_volume * static_cast<float>(piece_gains[i]));
            }
        }
    }
};

namespace {

/// Makes the voices of a scene. Those of the scene before are taken over where they play the same samples.
class VoiceMaker {
  public:
    VoiceMaker(const assets::SceneFile &scene, const std::filesystem::path &folder,
               std::multimap<std::string, std::unique_ptr<openal::Voice>> before)
        : scene_(scene), folder_(folder), before_(std::move(before)) {}

    /// Returns nullptr, with one message for each file, if it cannot be played. `placed`: it has
    /// a place, and plays one channel; else two, as they were recorded.
    std::unique_ptr<openal::Voice> voice(const std::string &artifact, bool placed) {
        const assets::Artifact &file = *scene_.find_artifact(artifact);
        const std::string key = file.sha256 + (placed ? " placed" : "");
        if (const auto found = before_.find(key); found != before_.end()) {
            return std::move(before_.extract(found).mapped());
        }
        const auto [made, is_new] = buffers_.try_emplace(key);
        if (is_new) {
            made->second = buffer(file, placed);
        }
        if (!made->second) {
            complete = false;
            return nullptr;
        }
        return std::make_unique<openal::Voice>(key, made->second);
    }

    bool complete = true;

  private:
    std::shared_ptr<const openal::Buffer> buffer(const assets::Artifact &file, bool placed) const {
        try {
            SoundSamples sound;
            if (const char *problem = read_sound(assets::read_artifact(file, folder_).bytes(), sound)) {
                throw Error(file.file + ": " + problem);
            }
            if (placed == (sound.channels > 1)) {
                sound = placed ? to_mono(sound) : to_stereo(sound);
            }
            alGetError();
            auto made = std::make_shared<const openal::Buffer>(sound);
            if (alGetError() != AL_NO_ERROR) {
                throw Error(file.file + ": the sound device rejects the samples");
            }
            return made;
        } catch (const std::bad_alloc &) {
            log_message("no sound: " + file.file + ": does not fit into memory");
        } catch (const std::exception &error) { // or the file has changed since the scene was loaded
            log_message(std::string("no sound: ") + error.what());
        }
        return nullptr;
    }

    const assets::SceneFile &scene_;
    const std::filesystem::path &folder_;
    std::multimap<std::string, std::unique_ptr<openal::Voice>> before_;
    std::map<std::string, std::shared_ptr<const openal::Buffer>> buffers_;
};

} // namespace

Audio::Audio(AudioOutput output) noexcept : impl_(std::make_unique<Impl>()) {
    impl_->output = output;
}

Audio::~Audio() = default;

bool Audio::load(const assets::SceneFile &scene, const std::filesystem::path &folder) {
    if (scene.sounds.empty() && !scene.music) {
        clear();
        return true;
    }
    if (const char *problem = impl_->open()) {
        log_message(std::string("no sound: ") + problem);
        return false;
    }
    std::multimap<std::string, std::unique_ptr<openal::Voice>> before;
    for (auto &[sound, voice] : impl_->sounds) {
        if (voice) {
            before.emplace(voice->key(), std::move(voice));
        }
    }
    for (std::unique_ptr<openal::Voice> &piece : impl_->pieces) {
        if (piece) {
            before.emplace(piece->key(), std::move(piece));
        }
    }
    impl_->sounds.clear();
    impl_->pieces.clear();
    VoiceMaker maker(scene, folder, std::move(before));
    for (const assets::Sound &sound : scene.sounds) {
        impl_->sounds.emplace_back(sound, maker.voice(sound.artifact, !sound.places.empty()));
    }
    const std::size_t pieces = scene.music ? scene.music->artifacts.size() : 0;
    for (std::size_t i = 0; i < pieces; ++i) {
        impl_->pieces.push_back(maker.voice(scene.music->artifacts[i], false));
    }
    if (!impl_->has_scene || static_cast<std::size_t>(impl_->music) > pieces) {
        impl_->music = scene.music ? scene.music->playing : 0;
        impl_->piece_gains.clear();
    }
    impl_->piece_gains.resize(pieces, 0.0);
    for (std::size_t i = 0; i < pieces && !impl_->has_scene; ++i) {
        impl_->piece_gains[i] = static_cast<int>(i) + 1 == impl_->music ? 1.0 : 0.0;
    }
    impl_->music_volume = scene.music ? scene.music->volume : 0.0F;
    impl_->duration_s = scene.flight.duration_s;
    impl_->has_scene = true;
    return maker.complete;
}

void Audio::play(double elapsed_s) noexcept {
    impl_->for_each_voice([&](const openal::Voice &voice) { voice.play(elapsed_s); });
}

void Audio::pause() noexcept {
    impl_->for_each_voice([](const openal::Voice &voice) { voice.pause(); });
}

void Audio::clear() noexcept {
    impl_->sounds.clear();
    impl_->pieces.clear();
    impl_->piece_gains.clear();
    impl_->music = 0;
    impl_->has_scene = false;
}

void Audio::update(const Pose &pose, double elapsed_s, double delta_s) noexcept {
    for (std::size_t i = 0; i < impl_->piece_gains.size(); ++i) {
        const double step = static_cast<int>(i) + 1 == impl_->music ? delta_s : -delta_s;
        impl_->piece_gains[i] = std::clamp(impl_->piece_gains[i] + step / music_fade_s, 0.0, 1.0);
    }
    impl_->place(pose, elapsed_s);
}

void Audio::next_music() noexcept {
    impl_->music = static_cast<std::size_t>(impl_->music) < impl_->pieces.size() ? impl_->music + 1 : 0;
}

int Audio::music() const {
    return impl_->music;
}

void Audio::set_volume(float volume) noexcept {
    impl_->volume = std::clamp(volume, 0.0F, 1.0F);
    impl_->set_listener();
}

float Audio::volume() const {
    return impl_->volume;
}

void Audio::set_muted(bool muted) noexcept {
    impl_->muted = muted;
    impl_->set_listener();
}

bool Audio::muted() const {
    return impl_->muted;
}

std::size_t Audio::playing() const {
    std::size_t count = 0;
    impl_->for_each_voice([&](const openal::Voice &voice) { count += voice.playing() ? 1 : 0; });
    return count;
}

bool Audio::render(std::span<float> out) noexcept {
    if (!impl_->context || impl_->render_samples == nullptr) {
        std::ranges::fill(out, 0.0F);
        return false;
    }
    impl_->render_samples(impl_->device.get(), out.data(), static_cast<ALCsizei>(out.size() / 2));
    return true;
}

} // namespace paradize
