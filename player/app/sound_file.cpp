#include "app/sound_file.hpp"

#include "app/audio.hpp"
#include "app/messages.hpp"
#include "app/new_file.hpp"
#include "app/open_sound.hpp"
#include "app/playback.hpp"
#include "app/stop.hpp"
#include "error.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace paradize {

void write_flight_sound(const assets::SceneFile &scene, const std::filesystem::path &folder, double time_s,
                        int frames, const std::filesystem::path &path) {
    Audio audio(AudioOutput::memory);
    if (!audio.load(scene, folder)) {
        throw Error(path.string() + ": not written: a sound cannot be played");
    }
    NewFile target(path);
    SF_INFO info{};
    info.samplerate = audio_rate_hz;
    info.channels = 2;
    info.format = SF_FORMAT_WAV | SF_FORMAT_PCM_16;
    errno = 0;
    OpenSound file(sf_open(target.part().c_str(), SFM_WRITE, &info));
    if (!file) {
        target.fail(errno, sf_strerror(nullptr));
    }
    constexpr auto block_frames = static_cast<std::size_t>(audio_rate_hz * frame_s + 0.5);
    std::vector<float> block(2 * block_frames);
    std::vector<std::int16_t> samples(block.size());
    std::size_t clipped = 0;
    for (int i = 0; i < frames; ++i) {
        if (stop_signal() != 0) {
            return;
        }
        const double now_s = time_s + i * frame_s;
        audio.update(flight_pose(scene.flight, now_s), now_s, i == 0 ? 0.0 : frame_s);
        if (i == 0) {
            audio.play(now_s);
        }
        audio.render(block);
        for (std::size_t k = 0; k < block.size(); ++k) {
            clipped += std::abs(block[k]) > 1.0F ? 1 : 0;
            samples[k] = static_cast<std::int16_t>(std::lround(std::clamp(block[k], -1.0F, 1.0F) * 32767.0F));
        }
        const auto count = static_cast<sf_count_t>(block_frames);
        errno = 0;
        if (sf_writef_short(file.get(), samples.data(), count) != count) {
            target.fail(errno, sf_strerror(file.get()));
        }
    }
    file.reset();
    target.commit();
    if (clipped > 0) {
        log_message(path.string() + ": " + std::to_string(clipped) +
                    " samples were cut off at full scale; lower the volume of the scene's sounds");
    }
}

} // namespace paradize
