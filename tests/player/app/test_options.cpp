#include "app/options.hpp"
#include "app/playback.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cstdint>

using namespace paradize;

namespace {

constexpr std::array<std::string_view, 2> passes{"sky", "water"};

Options parse(std::initializer_list<const char *> arguments) {
    return parse_options({arguments.begin(), arguments.size()}, passes);
}

} // namespace

TEST_CASE("command line: all documented options are accepted") {
    const Options o =
        parse({"scene", "--headless", "--time", "12.5", "--frames=3", "--size", "64x36", "--screenshot",
               "a.png", "--disable", "sky,water", "--wait-resident", "--json", "--mute"});
    CHECK_FALSE(o.bench);
    CHECK(parse({"scene", "--bench"}).bench);
    const Options limits = parse({"scene", "--vram", "256", "--ram=64.5"});
    CHECK(limits.vram_mb == 256.0);
    CHECK(limits.ram_mb == 64.5);
    CHECK_FALSE(o.vram_mb);
    CHECK(o.folder == "scene");
    CHECK(o.headless);
    CHECK(o.time_s == 12.5);
    CHECK(o.frames == 3);
    CHECK(o.width_px == 64);
    CHECK(o.height_px == 36);
    CHECK(o.screenshot == "a.png");
    CHECK(o.disabled == std::vector<std::string>{"sky", "water"});
    CHECK(o.wait_resident);
    CHECK(o.json);
    CHECK(o.mute);
}

TEST_CASE("command line: --vram and --ram are millions of bytes, --ram 256 MiB where nothing is said") {
    const MemoryLimits given = memory_limits(parse({"scene", "--vram", "2.5", "--ram=64"}));
    CHECK(given.vram_bytes == 2'500'000);
    CHECK(given.ram_bytes == 64'000'000);
    CHECK(memory_limits(parse({"scene"})).vram_bytes == 0);
    CHECK(memory_limits(parse({"scene"})).ram_bytes == std::uint64_t{256} << 20U);
    CHECK(memory_limits(parse({"scene", "--order", "file"})).order == UploadOrder::file);
}

TEST_CASE("command line: of a value given twice the last counts; passes and tiers given twice all count") {
    CHECK(parse({"a", "--time", "1", "--time=2"}).time_s == 2.0);
    CHECK(parse({"--disable", "sky", "a", "--disable=water"}).disabled ==
          std::vector<std::string>{"sky", "water"});
    Quality mixed = all_at(Tier::exact);
    mixed[static_cast<std::size_t>(QualityFeature::shadow)] = Tier::fast;
    CHECK(parse({"a", "--quality", "exact", "--quality", "shadow=fast"}).quality == mixed);
}

TEST_CASE("command line: --help needs no folder and lists the passes") {
    CHECK(parse({"--help"}).help.find("sky, water") != std::string::npos);
    CHECK(parse({"-h"}).help.find("--check-finite") != std::string::npos);
    CHECK(parse({"a"}).help.empty());
}

TEST_CASE("command line: wrong usage is an error") {
    CHECK_THROWS_AS(parse({}), UsageError);
    CHECK_THROWS_AS(parse({"a", "b"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--nonsense"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--bench", "--interactive"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--bench", "--screenshot", "a.png"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--bench", "--check-finite"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--bench=3"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--time"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--time", "nan"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--time", "-1"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--frames", "0"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--frames", "2.5"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--size", "640"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--size", "0x4"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--screenshot", "a.jpg"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--headless=1"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--vram", "0"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--ram", "nan"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--headless", "--interactive"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--frames", "3", "--interactive"}), UsageError);
    CHECK_THROWS_WITH_AS(parse({"a", "--panel", "--headless"}),
                         "--panel is the title of the window: leave out --headless", UsageError);
    CHECK(parse({"a", "--order", "needs", "--vram", "9"}).vram_mb == 9.0);
    CHECK_THROWS_WITH_AS(
        parse({"a", "--vram", "9", "--order", "file"}),
        "--order file uploads everything, --vram only what the picture needs most: leave out "
        "one of them",
        UsageError);
    CHECK_THROWS_WITH_AS(parse({"a", "--disable", "sky,wter"}),
                         "--disable wter: is not a pass; choose from sky, water", UsageError);
}

TEST_CASE("command line: tiers for all features and for single ones") {
    CHECK(parse({"a"}).quality == all_at(Tier::balanced));
    CHECK(parse({"a", "--quality", "exact"}).quality == all_at(Tier::exact));
    Quality mixed = all_at(Tier::balanced);
    mixed[static_cast<std::size_t>(QualityFeature::shadow)] = Tier::fast;
    mixed[static_cast<std::size_t>(QualityFeature::lod)] = Tier::exact;
    CHECK(parse({"a", "--quality=shadow=fast,lod=exact"}).quality == mixed);
    CHECK(parse({"a", "--quality", "fast,balanced,shadow=fast,lod=exact"}).quality == mixed);
    CHECK_THROWS_WITH_AS(parse({"a", "--quality", "best"}),
                         "--quality best: is not a tier; choose from fast, balanced, exact", UsageError);
    CHECK_THROWS_WITH_AS(parse({"a", "--quality", "shadow=best"}),
                         "--quality best: is not a tier; choose from fast, balanced, exact", UsageError);
    CHECK_THROWS_WITH_AS(parse({"a", "--quality", "sky=fast"}),
                         "--quality sky: is not a quality feature; choose from shadow, reflection, "
                         "refraction, parallax, anisotropy, lod, resolution",
                         UsageError);
    CHECK_THROWS_AS(parse({"a", "--quality", ""}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--quality", "fast,"}), UsageError);
}

TEST_CASE("command line: --audio names a WAV file, for a flight that nobody steers") {
    CHECK(parse({"a", "--audio", "b.wav"}).audio == "b.wav");
    CHECK(parse({"a", "--audio=b.wav", "--frames", "9", "--screenshot", "c.png"}).frames == 9);
    CHECK_THROWS_AS(parse({"a", "--audio", "b.ogg"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--audio", "b.wav", "--interactive"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--audio", "b.wav", "--mute"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--audio", "b.wav", "--bench"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--audio", "b.wav", "--json"}), UsageError);
}

TEST_CASE("command line: --reference and --fps exclude --quality") {
    CHECK(parse({"a", "--reference", "64", "--screenshot", "a.png"}).reference == 64);
    CHECK(parse({"a", "--fps", "59.94"}).fps == 59.94);
    CHECK_THROWS_AS(parse({"a", "--reference", "64"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--reference", "0", "--screenshot", "a.png"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--reference", "4", "--screenshot", "a.png", "--quality", "fast"}),
                    UsageError);
    CHECK_THROWS_AS(parse({"a", "--reference", "4", "--screenshot", "a.png", "--fps", "9"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--fps", "0"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--fps", "nan"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--fps", "30", "--quality", "fast"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--fps", "30", "--bench"}), UsageError);
}
