#include "app/audio.hpp"

#include "app/messages.hpp"

#include <AL/al.h>
#include <AL/alc.h>
#include <sndfile.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <new>
#include <span>

namespace paradize {

namespace {

constexpr std::size_t max_samples = std::size_t{1} << 27; // 256 MiB of 16-bit samples
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

namespace {

/// Gives libsndfile read access to bytes in memory.
struct Reader {
    std::span<const std::byte> bytes;
    sf_count_t at = 0;

    static Reader &of(void *self) { return *static_cast<Reader *>(self); }
    static sf_count_t size(void *self) { return static_cast<sf_count_t>(of(self).bytes.size()); }
    static sf_count_t seek(sf_count_t offset, int whence, void *self) {
        const sf_count_t from = whence == SEEK_SET ? 0 : whence == SEEK_CUR ? of(self).at : size(self);
        if (offset < -from || offset > size(self) - from) {
            return -1;
        }
        return of(self).at = from + offset;
    }
    static sf_count_t read(void *out, sf_count_t count, void *self) {
        const sf_count_t got = std::clamp<sf_count_t>(count, 0, size(self) - of(self).at);
        std::copy_n(of(self).bytes.data() + of(self).at, got, static_cast<std::byte *>(out));
        of(self).at += got;
        return got;
    }
    static sf_count_t write(const void * /*bytes*/, sf_count_t /*count*/, void * /*self*/) { return 0; }
    static sf_count_t tell(void *self) { return of(self).at; }
};

} // namespace

const char *read_sound(std::span<const std::byte> bytes, SoundSamples &out) {
    SF_INFO info{};
    SF_VIRTUAL_IO calls{Reader::size, Reader::seek, Reader::read, Reader::write, Reader::tell};
    Reader reader{bytes};
    const std::unique_ptr<SNDFILE, CloseFile> file(sf_open_virtual(&calls, SFM_READ, &info, &reader));
    if (!file) {
        return sf_strerror(nullptr);
    }
    if (info.channels < 1 || info.channels > 2 || info.samplerate < 1) {
        return "is not mono or stereo";
    }
    out.channels = info.channels;
    out.rate_hz = info.samplerate;
    // Decodes to float and clips here, because libsndfile wraps loud Vorbis samples when it converts them to
    // integers. The vector grows while reading, because a header may promise more frames than the file holds.
    std::vector<float> block(static_cast<std::size_t>(block_frames * info.channels));
    while (const sf_count_t frames = sf_readf_float(file.get(), block.data(), block_frames)) {
        const auto count = static_cast<std::size_t>(frames * info.channels);
        if (frames < 0 || out.samples.size() + count > max_samples) {
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

    /// Returns what went wrong, or nullptr.
    const char *load(std::span<const std::byte> bytes) {
        SoundSamples sound;
        if (const char *problem = read_sound(bytes, sound)) {
            return problem;
        }
        if (!context) {
            device.reset(alcOpenDevice(nullptr));
            if (!device) {
                return "there is no sound device";
            }
            context.reset(alcCreateContext(device.get(), nullptr));
            if (!context || alcMakeContextCurrent(context.get()) != ALC_TRUE) {
                return "the sound device offers no context";
            }
        }
        clear();
        alGetError();
        alGenBuffers(1, &buffer);
        alGenSources(1, &source);
        alBufferData(buffer, sound.channels == 1 ? AL_FORMAT_MONO16 : AL_FORMAT_STEREO16,
                     sound.samples.data(), static_cast<ALsizei>(sound.samples.size() * sizeof(std::int16_t)),
                     sound.rate_hz);
        alSourcei(source, AL_BUFFER, static_cast<ALint>(buffer));
        alSourcei(source, AL_LOOPING, AL_TRUE);
        alSourcef(source, AL_GAIN, volume);
        return alGetError() == AL_NO_ERROR ? nullptr : "the sound device rejects the samples";
    }
};

Audio::Audio() noexcept = default;
Audio::~Audio() = default;

bool Audio::load(std::span<const std::byte> bytes, const std::string &name) {
    impl_ = std::make_unique<Impl>();
    const char *problem = nullptr;
    try {
        problem = impl_->load(bytes);
    } catch (const std::bad_alloc &) {
        problem = "does not fit into memory";
    }
    if (problem != nullptr) {
        log_message("no sound: " + name + ": " + problem);
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
