#include "options.hpp"

#include <doctest/doctest.h>

#include <array>

using namespace paradize;

namespace {

constexpr std::array<std::string_view, 2> passes{"sky", "water"};

Options parse(std::initializer_list<const char *> arguments) {
    return parse_options({arguments.begin(), arguments.size()}, passes);
}

} // namespace

TEST_CASE("command line: the contract's options are taken") {
    const Options o =
        parse({"scene", "--headless", "--time", "12.5", "--frames=3", "--size", "64x36", "--screenshot",
               "a.png", "--disable", "sky,water", "--wait-resident", "--json", "--mute"});
    CHECK_FALSE(o.bench);
    CHECK(parse({"scene", "--bench"}).bench);
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

TEST_CASE("command line: wrong usage is told, never guessed") {
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
    CHECK_THROWS_AS(parse({"a", "--headless", "--interactive"}), UsageError);
    CHECK_THROWS_AS(parse({"a", "--frames", "3", "--interactive"}), UsageError);
    CHECK_THROWS_WITH_AS(parse({"a", "--disable", "sky,wter"}),
                         "--disable wter: is no pass; passes are sky, water", UsageError);
}
