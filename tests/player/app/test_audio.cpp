#include "app/audio.hpp"
#include "app/sound_file.hpp"
#include "app/sound_samples.hpp"
#include "assets/file_bytes.hpp"
#include "error.hpp"
#include "files.hpp"

#include <doctest/doctest.h>
#include <sndfile.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

using namespace paradize;

namespace {

/// Writes 0.1 s of a tone of 440 Hz, a whole number of periods.
void write_tone(const std::filesystem::path &path, int channels = 1) {
    SF_INFO info{};
    info.samplerate = audio_rate_hz;
    info.channels = channels;
    info.format = SF_FORMAT_WAV | SF_FORMAT_PCM_16;
    SNDFILE *file = sf_open(path.c_str(), SFM_WRITE, &info);
    REQUIRE(file != nullptr);
    std::vector<short> samples;
    for (int i = 0; i < 4410; ++i) {
        const double value = 8000.0 * std::sin(2.0 * 3.141592653589793 * 440.0 * i / audio_rate_hz);
        samples.insert(samples.end(), static_cast<std::size_t>(channels), static_cast<short>(value));
    }
    CHECK(sf_writef_short(file, samples.data(), 4410) == 4410);
    sf_close(file);
}

/// The scene of tests/player/files.cpp with sounds and music of the file tone.wav.
assets::SceneFile scene_with(const test::Folder &folder, const std::string &sounds,
                             const std::string &music = "null") {
    write_tone(folder.path() / "tone.wav");
    const assets::FileBytes tone(folder.path() / "tone.wav");
    std::string text = test::SceneText().str();
    text.replace(text.find("\"sounds\": [], \"music\": null"), 27,
                 "\"sounds\": " + sounds + ", \"music\": " + music);
    const std::string entry =
        R"("tone": {"file": "tone.wav", "kind": "sound", )" + test::identity(tone.bytes()) + "},\n";
    text.insert(text.find("\"sky\": {\"file\""), entry);
    return assets::parse_scene(text, "scene.json");
}

const std::string everywhere =
    R"({"name": null, "artifact": "tone", "volume": 0.5, "places": [], "radius_m": 1, "falloff": 1, "hours": null})";

double loudest(Audio &audio) {
    std::vector<float> block(2 * 2048);
    audio.render(block); // gains move over a block
    audio.render(block);
    double out = 0.0;
    for (const float value : block) {
        out = std::max(out, std::abs(static_cast<double>(value)));
    }
    return out;
}

} // namespace

TEST_CASE("sound: empty and invalid files leave playback silent, files of all the rest play") {
    const test::Folder folder;
    const assets::SceneFile scene = scene_with(folder, "[" + everywhere + "]");
    folder.write("tone.wav", std::string("no sound at all"));
    Audio audio(AudioOutput::memory);
    CHECK_FALSE(audio.load(scene, folder.path()));
    audio.update(Pose(), 0.0, 0.0);
    audio.play(0.0);
    audio.pause();
    audio.next_music();
    CHECK(audio.playing() == 0);
    CHECK(audio.music() == 0);
    CHECK_THROWS_AS(write_flight_sound(scene, folder.path(), 0.0, 1, folder.path() / "out.wav"), Error);
    CHECK_FALSE(std::filesystem::exists(folder.path() / "out.wav"));
}

TEST_CASE("sound: samples above full scale are clipped, not wrapped; float files are read") {
    const test::Folder folder;
    const auto path = folder.path() / "loud.wav";
    SF_INFO info{};
    info.samplerate = 8000;
    info.channels = 2;
    info.format = SF_FORMAT_WAV | SF_FORMAT_FLOAT;
    SNDFILE *file = sf_open(path.c_str(), SFM_WRITE, &info);
    REQUIRE(file != nullptr);
    const std::array<float, 6> loud{0.5F, -0.5F, 1.5F, -1.5F, std::numeric_limits<float>::quiet_NaN(), 0.0F};
    CHECK(sf_writef_float(file, loud.data(), 3) == 3);
    sf_close(file);
    SoundSamples sound;
    CHECK(read_sound(assets::FileBytes(path).bytes(), sound) == nullptr);
    CHECK(sound.channels == 2);
    CHECK(sound.rate_hz == 8000);
    CHECK(sound.samples == std::vector<std::int16_t>{16384, -16384, 32767, -32767, 0, 0});
    CHECK(to_mono(sound).samples == std::vector<std::int16_t>{0, 0, 0});
    CHECK(to_mono({{100, 300, -2, -4}, 2, 8000}).samples == std::vector<std::int16_t>{200, -3});
    CHECK(to_stereo({{7, -9}, 1, 8000}).samples == std::vector<std::int16_t>{7, 7, -9, -9});
}

TEST_CASE("sound: play, pause, volume and mute") {
    const test::Folder folder;
    Audio audio(AudioOutput::memory);
    CHECK(audio.load(scene_with(folder, "[" + everywhere + "]"), folder.path()));
    CHECK(audio.playing() == 0);
    audio.update(Pose(), 0.0, 0.0);
    audio.play(0.0);
    CHECK(audio.playing() == 1);
    const double full = loudest(audio);
    CHECK(full == doctest::Approx(0.5 * 8000.0 / 32767.0).epsilon(0.02)); // as recorded, at its volume
    audio.set_volume(0.25F);
    CHECK(loudest(audio) == doctest::Approx(0.25 * full).epsilon(0.02));
    audio.set_volume(9.0F);
    CHECK(audio.volume() == 1.0F);
    audio.set_muted(true);
    CHECK(loudest(audio) == 0.0);
    audio.set_muted(false);
    CHECK(loudest(audio) == doctest::Approx(full).epsilon(0.02));
    audio.pause();
    CHECK(audio.playing() == 0);
    CHECK(loudest(audio) == 0.0);
    audio.clear();
    CHECK(loudest(audio) == 0.0);
}

TEST_CASE("sound: what a new scene plays as before goes on, what it does not name ends") {
    const test::Folder folder;
    Audio audio(AudioOutput::memory);
    audio.load(scene_with(folder, "[" + everywhere + "]"), folder.path());
    audio.update(Pose(), 0.0, 0.0);
    audio.play(0.0);
    CHECK(audio.load(scene_with(folder, "[" + everywhere + "," + everywhere + "]"), folder.path()));
    CHECK(audio.playing() == 1); // the second is new
    audio.play(0.0);
    CHECK(audio.playing() == 2);
    audio.load(scene_with(folder, "[" + everywhere + "]"), folder.path());
    CHECK(audio.playing() == 1);
    audio.load(scene_with(folder, "[]"), folder.path());
    CHECK(audio.playing() == 0);
}

TEST_CASE("sound: a file that is heard everywhere and at a place sounds everywhere as it was recorded") {
    const test::Folder folder;
    const std::string silent_there =
        test::replaced(test::replaced(everywhere, R"("volume": 0.5)", R"("volume": 0)"), "[]", "[[9, 0, 0]]");
    Audio audio(AudioOutput::memory);
    CHECK(audio.load(scene_with(folder, "[" + silent_there + "," + everywhere + "]"), folder.path()));
    audio.update(Pose(), 0.0, 0.0);
    audio.play(0.0);
    CHECK(audio.playing() == 2);
    CHECK(loudest(audio) == doctest::Approx(0.5 * 8000.0 / 32767.0).epsilon(0.02));
}

TEST_CASE("music: a key goes from piece to piece and to none; each fades") {
    const test::Folder folder;
    Audio audio(AudioOutput::memory);
    audio.load(scene_with(folder, "[]", R"({"artifacts": ["tone", "tone"], "volume": 1, "playing": 0})"),
               folder.path());
    audio.update(Pose(), 0.0, 0.0);
    audio.play(0.0);
    CHECK(loudest(audio) == 0.0);
    audio.next_music();
    CHECK(audio.music() == 1);
    audio.update(Pose(), 0.0, 0.5);
    const double half = loudest(audio);
    CHECK(half > 0.0);
    audio.update(Pose(), 0.0, 5.0);
    CHECK(loudest(audio) > 1.5 * half);
    audio.next_music();
    CHECK(audio.music() == 2);
    audio.next_music();
    CHECK(audio.music() == 0);
    audio.update(Pose(), 0.0, 5.0);
    CHECK(loudest(audio) == 0.0);
    Audio first(AudioOutput::memory);
    first.load(scene_with(folder, "[]", R"({"artifacts": ["tone", "tone"], "volume": 1, "playing": 2})"),
               folder.path());
    first.update(Pose(), 0.0, 0.0);
    first.play(0.0);
    CHECK(first.music() == 2);
    const double full = loudest(first);
    CHECK(full > 0.1);
    Audio quiet(AudioOutput::memory);
    quiet.load(scene_with(folder, "[]", R"({"artifacts": ["tone"], "volume": 0.25, "playing": 1})"),
               folder.path());
    quiet.update(Pose(), 0.0, 0.0);
    quiet.play(0.0);
    CHECK(loudest(quiet) == doctest::Approx(0.25 * full).epsilon(0.02));
}

TEST_CASE("sound: a device is opened only for a scene that has a sound") {
    const test::Folder folder;
    Audio audio;
    CHECK(audio.load(scene_with(folder, "[]"), folder.path()));
    if (!audio.load(scene_with(folder, "[" + everywhere + "]"), folder.path())) {
        MESSAGE("no sound device, not even ALSOFT_DRIVERS=null");
        return;
    }
    audio.play(0.0);
    CHECK(audio.playing() == 1);
}
