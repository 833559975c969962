#include "audio.hpp"

#include <AL/al.h>
#include <AL/alc.h>
#include <sndfile.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <vector>

namespace paradize {

namespace {

constexpr sf_count_t most_samples = sf_count_t{1} << 27; // 256 MiB of 16 bits

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
        SF_INFO info{};
        const std::unique_ptr<SNDFILE, CloseFile> file(sf_open(path.c_str(), SFM_READ, &info));
        if (!file) {
            return sf_strerror(nullptr);
        }
        if (info.channels < 1 || info.channels > 2 || info.frames < 1 || info.samplerate < 1 ||
            info.frames > most_samples / info.channels) {
            return "is not mono or stereo, is empty or too long";
        }
        std::vector<std::int16_t> samples(static_cast<std::size_t>(info.frames * info.channels));
        const sf_count_t read = sf_readf_short(file.get(), samples.data(), info.frames);
        if (read < 1) {
            return "holds no samples";
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
        alBufferData(buffer, info.channels == 1 ? AL_FORMAT_MONO16 : AL_FORMAT_STEREO16, samples.data(),
                     static_cast<ALsizei>(read * info.channels * 2), info.samplerate);
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
    if (const char *problem = impl_->load(file)) {
        std::fprintf(stderr, "paradize-player: no sound: %s: %s\n", file.c_str(), problem);
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
