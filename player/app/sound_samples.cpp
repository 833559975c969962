#include "app/sound_samples.hpp"

#include "app/open_sound.hpp"

#include <algorithm>
#include <cmath>

namespace paradize {

namespace {

constexpr std::size_t max_sound_samples = std::size_t{1} << 27; // 256 MiB of 16-bit samples
constexpr sf_count_t block_frames = 16384;

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
    const OpenSound file(sf_open_virtual(&calls, SFM_READ, &info, &reader));
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
        if (frames < 0 || out.samples.size() + count > max_sound_samples) {
            return "is too long";
        }
        for (const float value : std::span(block).first(count)) {
            const float kept = std::isfinite(value) ? std::clamp(value, -1.0F, 1.0F) : 0.0F;
            out.samples.push_back(static_cast<std::int16_t>(std::lround(kept * 32767.0F)));
        }
    }
    return out.samples.empty() ? "holds no samples" : nullptr;
}

SoundSamples to_mono(const SoundSamples &sound) {
    SoundSamples out{{}, 1, sound.rate_hz};
    const auto channels = static_cast<std::size_t>(sound.channels);
    out.samples.reserve(sound.frames());
    for (std::size_t i = 0; i < sound.samples.size(); i += channels) {
        const int sum = sound.samples[i] + sound.samples[i + channels - 1];
        out.samples.push_back(static_cast<std::int16_t>(sum / 2));
    }
    return out;
}

SoundSamples to_stereo(const SoundSamples &sound) {
    SoundSamples out{{}, 2, sound.rate_hz};
    out.samples.reserve(2 * sound.samples.size());
    for (const std::int16_t sample : sound.samples) {
        out.samples.insert(out.samples.end(), 2, sample);
    }
    return out;
}

} // namespace paradize
