#include "audio.hpp"

#include "messages.hpp"

#include <AL/al.h>
#include <AL/alc.h>
#include <sndfile.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <span>

namespace paradize {

namespace {

constexpr std::size_t most_samples = std::size_t{1} << 27; // 256 MiB of 16 bits
constexpr sf_count_t block_frames = 16384;

struct CloseFile {
    void operator()(SNDFILE *file) const { sf_close(file); }
};
struct CloseDevice {
    void operator()(ALCdevice *device) const { alcCloseDevice(device); }
};
struct CloseContext {
    void operator()(ALCcontext *context) const {
        alcMakeContextCurrent(nullptr);
        alcDestroyContext(context);
    }
};

} // namespace

const char *read_sound(const std::filesystem::path &path, SoundSamples &out) {
    std::error_code unknown;
    if (!std::filesystem::is_regular_file(path, unknown)) { // opening a pipe would wait for ever
        return "is no file";
    }
    SF_INFO info{};
    const std::unique_ptr<SNDFILE, CloseFile> file(sf_open(path.c_str(), SFM_READ, &info));
    if (!file) {
        return sf_strerror(nullptr);
    }
    if (info.channels < 1 || info.channels > 2 || info.samplerate < 1) {
        return "is not mono or stereo";
    }
    out.channels = info.channels;
    out.per_s = info.samplerate;
    // As floats, clipped here: libsndfile's conversion of Vorbis to integers wraps what is too loud. Grows as
    // it is read: a header may promise what the file does not hold.
    std::vector<float> block(static_cast<std::size_t>(block_frames * info.channels));
    while (const sf_count_t frames = sf_readf_float(file.get(), block.data(), block_frames)) {
        const auto count = static_cast<std::size_t>(frames * info.channels);
        if (frames < 0 || out.samples.size() + count > most_samples) {
            return "is too long";
        }
        for (const float value : std::span(block).first(count)) {
            const float kept = std::isfinite(value) ? std::clamp(value, -1.0F, 1.0F) : 0.0F;
            out.samples.push_back(static_cast<std::int16_t>(std::lround(kept * 32767.0F)));
        }
    }
    return out.samples.empty() ? "holds no samples" : nullptr;
}

struct Audio::Impl {
    std::unique_ptr<ALCdevice, CloseDevice> device;
    std::unique_ptr<ALCcontext, CloseContext> context;
    ALuint source = 0;
    ALuint buffer = 0;
    float volume = 1.0F;

    ~Impl() { clear(); }

    void clear() {
        if (source != 0) {
            alDeleteSources(1, &source);
        }
        if (buffer != 0) {
            alDeleteBuffers(1, &buffer);
        }
        source = 0;
        buffer = 0;
    }

    /// What went wrong, or nullptr.
    const char *load(const std::filesystem::path &path) {
        SoundSamples sound;
        if (const char *problem = read_sound(path, sound)) {
            return problem;
        }
        if (!context) {
            device.reset(alcOpenDevice(nullptr));
            if (!device) {
                return "there is no sound device";
            }
            context.reset(alcCreateContext(device.get(), nullptr));
            if (!context || alcMakeContextCurrent(context.get()) != ALC_TRUE) {
                return "the sound device gives no context";
            }
        }
        clear();
        alGetError();
        alGenBuffers(1, &buffer);
        alGenSources(1, &source);
        alBufferData(buffer, sound.channels == 1 ? AL_FORMAT_MONO16 : AL_FORMAT_STEREO16,
                     sound.samples.data(), static_cast<ALsizei>(sound.samples.size() * sizeof(std::int16_t)),
                     sound.per_s);
        alSourcei(source, AL_BUFFER, static_cast<ALint>(buffer));
        alSourcei(source, AL_LOOPING, AL_TRUE);
        alSourcef(source, AL_GAIN, volume);
        return alGetError() == AL_NO_ERROR ? nullptr : "the sound device refuses the samples";
    }
};

Audio::Audio() noexcept = default;
Audio::~Audio() = default;

bool Audio::load(const std::filesystem::path &file) {
    impl_ = std::make_unique<Impl>();
    const char *problem = nullptr;
    try {
        problem = impl_->load(file);
    } catch (const std::bad_alloc &) {
        problem = "is too long for the memory that is left";
    }
    if (problem != nullptr) {
        say("no sound: " + file.string() + ": " + problem);
        impl_.reset();
    }
    return impl_ != nullptr;
}

void Audio::play() {
    if (impl_) {
        alSourcePlay(impl_->source);
    }
}

void Audio::pause() {
    if (impl_) {
        alSourcePause(impl_->source);
    }
}

void Audio::stop() {
    if (impl_) {
        alSourceStop(impl_->source);
    }
}

void Audio::set_volume(float volume) {
    if (impl_) {
        impl_->volume = std::clamp(volume, 0.0F, 1.0F);
        alSourcef(impl_->source, AL_GAIN, impl_->volume);
    }
}

float Audio::volume() const {
    return impl_ ? impl_->volume : 0.0F;
}

bool Audio::playing() const {
    ALint state = AL_STOPPED;
    if (impl_) {
        alGetSourcei(impl_->source, AL_SOURCE_STATE, &state);
    }
    return state == AL_PLAYING;
}

} // namespace paradize
