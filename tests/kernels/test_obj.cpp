// OBJ text without Python: what is read, what is told, and that nothing breaks the parser.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "obj/number.hpp"
#include "obj/parse.hpp"
#include "obj/triangulate.hpp"

using namespace paradize::obj;

namespace {

Parsed read(const std::string &text) {
    return parse(text, Limits{});
}

template <typename Real = float>
Real number(const std::string &text, NumberFault expected = NumberFault::none) {
    const char *p = text.data();
    Real value = -1;
    CHECK(read_number(p, text.data() + text.size(), value) == expected);
    CHECK(p == text.data() + (expected == NumberFault::none ? text.size() : 0));
    return value;
}

} // namespace

TEST_CASE("numbersAreTheNearestFloat") {
    CHECK(number("0.1") == 0.1f);
    CHECK(number("-12.5e-1") == -1.25f);
    CHECK(number("+.5") == 0.5f);
    CHECK(number("16777217") == 16777216.0f);           // a tie, to even
    CHECK(number("16777217.000000001") == 16777218.0f); // just above the tie: rounding twice would miss it
    CHECK(number("1e-46") == 0.0f);
    CHECK(number("1e-45") == 1.4e-45f);
    CHECK(number("3.4028235e38") == 3.4028235e38f);
    CHECK(std::signbit(number("-0")));
}

TEST_CASE("numbersAreTheNearestDoubleAndRoundToTheNearestFloat") {
    CHECK(number<double>("0.1") == 0.1);
    CHECK(number<double>("-5234567.123456789") == -5234567.123456789);
    CHECK(number<double>("12345678901234567890e-12") == 12345678.90123456789);
    CHECK(number<double>("16777217") == 16777217.0);
    CHECK(number<double>("1e-46") == 1e-46);
    CHECK(std::signbit(number<double>("-0")));
    for (const char *text : {"16777217.000000001", "7.0000005960464477540", "1.00000005960464477539",
                             "1.17549435e-38", "2.1019476964872256e-45", "3.4028235e38"})
        CHECK(static_cast<float>(number<double>(text)) == number(text));
    number<double>("3.5e38", NumberFault::too_large); // no float32 holds it
}

TEST_CASE("positionsFarAwayAreCountedFromAPlaceInTheirMidst") {
    const Parsed far =
        read("v 5000000.1 0.5 -1000000\nv 5000001.1 0.5 -1000000\nv 5000000.1 1.5 -1000000.3\nf 1 2 3\n");
    CHECK(far.origin[0] == 5000000);
    CHECK(far.origin[1] == 0);
    CHECK(far.origin[2] == -1000000);
    CHECK(far.positions[0] == static_cast<float>(5000000.1 - 5000000));
    CHECK(far.texts[0] == 5000000.1);
    const Parsed near = read("v 7.1 0.5 0\nv 8.1 0.5 0\nv 7.1 1.5 -0\nf 1 2 3\n");
    CHECK(near.origin == std::array<double, 3>{});
    CHECK(near.positions[0] == 7.1f);
    // Statements that no face names move nothing.
    CHECK(read("v 1e9 1e9 1e9\nv 7 0 0\nv 8 0 0\nv 7 1 0\nf 2 3 4\n").origin == std::array<double, 3>{});
}

TEST_CASE("partsThatLieFarFromTheMostOfAModelDoNotTakeItsDigits") {
    std::string text;
    for (int i = 0; i < 40; ++i)
        text += "v " + std::to_string(1000000 + i % 7 * 0.125) + " 0 " + std::to_string(i / 7 * 0.125) + "\n";
    text += "v 0 0 0\n";
    for (int i = 1; i < 33; ++i)
        text += "f " + std::to_string(i) + " " + std::to_string(i + 1) + " " + std::to_string(i + 8) + "\n";
    CHECK(read(text + "f 1 2 41\n").origin[0] > 999999);
    CHECK(read(text).origin[0] > 999999);
}

TEST_CASE("numbersThatAreNoneAreToldAndLeftInPlace") {
    for (const char *text : {"", "-", "+-1", "e5", ".", "abc", "--1"})
        number(text, NumberFault::garbage);
    for (const char *text : {"1e39", "3.5e38", "1e400", "1e99999"})
        number(text, NumberFault::too_large);
    for (const char *text : {"nan", "-inf", "infinity"})
        number(text, NumberFault::not_finite);
}

TEST_CASE("everyPolygonGivesTwoTrianglesLessThanCorners") {
    std::uint64_t work = 1'000'000;
    for (std::size_t n = 3; n < 40; ++n) {
        std::vector<std::array<double, 3>> star(n);
        for (std::size_t i = 0; i < n; ++i) {
            const double a = 6.283185307179586 * static_cast<double>(i) / static_cast<double>(n),
                         r = i % 2 ? 1 : 0.3;
            star[i] = {r * std::cos(a), 2, r * std::sin(a)};
        }
        std::vector<std::uint32_t> out;
        Triangulator().cut(star, work, out);
        CHECK(out.size() == 3 * (n - 2));
        for (const std::uint32_t corner : out)
            CHECK(corner < n);
    }
}

TEST_CASE("aConcavePolygonIsCutInside") {
    std::uint64_t work = 1000;
    std::vector<std::uint32_t> out;
    const std::vector<std::array<double, 3>> dart = {{0, 0, 0}, {2, 2, 0}, {0, 0.5, 0}, {-2, 2, 0}};
    CHECK(Triangulator().cut(dart, work, out) == Cut::sound);
    double area = 0;
    for (std::size_t t = 0; t < out.size(); t += 3) {
        const auto &a = dart[out[t]], &b = dart[out[t + 1]], &c = dart[out[t + 2]];
        const double turn = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        CHECK(turn > 0);
        area += turn / 2;
    }
    CHECK(area == doctest::Approx(1.0));
}

TEST_CASE("workRunsOutBeforePatience") {
    std::uint64_t work = 10;
    std::vector<std::array<double, 3>> zigzag;
    for (int i = 0; i < 400; ++i)
        zigzag.push_back({static_cast<double>(i / 2), i % 2 ? 5.0 : 0.1 * i, 0});
    std::vector<std::uint32_t> out;
    CHECK(Triangulator().cut(zigzag, work, out) == Cut::unchecked);
    CHECK(out.size() == 3 * (zigzag.size() - 2));
    CHECK(work == 0);
}

TEST_CASE("equalValuesUnderOtherNumbersAreOneVertex") {
    const Parsed found = read("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nf 4 5 3\n");
    CHECK(found.fault_count == 0);
    CHECK(std::ranges::equal(found.triangles, std::vector<std::uint32_t>{0, 1, 2, 1, 3, 2}));
    CHECK(found.positions.size() == 12);
}

TEST_CASE("vIsTurnedOnce") {
    const Parsed found = read("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.25 0.25\nf 1/1 2/1 3/1\n");
    CHECK(found.uvs[0] == 0.25f);
    CHECK(found.uvs[1] == 0.75f);
}

TEST_CASE("textureCoordinatesAndNormalsThatAreNoNumbersAreZeroAndTold") {
    const std::string mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (const char *word : {"nan", "-NaN(ind)", "-1.#IND00", "1.#QNAN", "inf", "-Infinity"}) {
        const std::string text = mesh + "vt 0.5 " + word + "\nvn 0 0 " + word + "\nf 1/1/1 2/1/1 3/1/1\n";
        const Parsed found = read(text);
        CHECK(found.fault_count == 0);
        CHECK(std::ranges::count(found.notes, "nan_uvs", &Note::what) == 1);
        CHECK(std::ranges::count(found.notes, "nan_normals", &Note::what) == 1);
        CHECK(std::ranges::all_of(found.normals, [](float v) { return v == 0; }));
    }
    CHECK(read(mesh + "vt 0.5 x\nf 1 2 3\n").fault_count == 1);
    CHECK(read(mesh + "v 0 0 nan\nf 1 2 3\n").fault_count == 1);
    CHECK(read(mesh + "v 0 0 -1.#IND\nf 1 2 3\n").fault_count == 1);
    CHECK(read(mesh + "v 0 0 1.5#a comment\nv 0 0 1.#comment\nf 1 2 3\n").fault_count == 0);
}

TEST_CASE("coloursThatAreNoNumbersAreWhiteAndTold") {
    for (const char *word : {"nan", "-1.#IND00", "inf"}) {
        const std::string first = std::string("v 0 0 0 0.5 ") + word + " 0.5 0.25\n";
        const Parsed found = read(first + "v 1 0 0 0.5 1 0 0.25\nv 0 1 0 1 0 0\nf 1 2 3\n");
        CHECK(found.fault_count == 0);
        CHECK(std::ranges::count(found.notes, "nan_colors", &Note::what) == 1);
        CHECK(std::ranges::equal(found.colors, std::vector<float>{1, 1, 1, 1, 0.5, 1, 0, 0.25, 1, 0, 0, 1}));
    }
    CHECK(read("v 0 0 0 1 x 1\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").fault_count == 1);
}

TEST_CASE("polypaintOfZBrushIsTheColourOfEachPosition") {
    const std::string mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\n#MRGB ffff8000ff00ff00\n#MRGB 000000ff\nf 1 2 3\n";
    const Parsed painted = read(mesh);
    CHECK(std::vector(painted.colors.begin(), painted.colors.end()) ==
          std::vector{1.0f, 128.0f / 255.0f, 0.0f, 1.0f, 0.0f, 1.0f, 0.0f, 1.0f, 0.0f, 0.0f, 1.0f, 1.0f});
    const auto is_told = [](const Parsed &parsed) {
        return std::ranges::count(parsed.notes, "polypaint", &Note::what) == 1;
    };
    CHECK(!is_told(painted));
    for (const char *wrong : {"#MRGB ff00", "#MRGB xyxyxyxy"}) {
        const Parsed less = read("v 0 0 0\nv 1 0 0\nv 0 1 0\n" + std::string(wrong) + "\nf 1 2 3\n");
        CHECK(less.colors.empty());
        CHECK(is_told(less));
    }
}

TEST_CASE("faultsCarryTheirLine") {
    const Parsed found = read("v 0 0 0\n\nv 0 x 0\nf 1 2 3\n");
    REQUIRE(found.faults.size() == 2);
    CHECK(found.faults[0].line == 3);
    CHECK(found.faults[1].line == 4);
    CHECK(found.triangles.empty());
}

TEST_CASE("unknownKeywordsAreToldOnceEachAndNotWithoutEnd") {
    std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    for (int i = 0; i < 1000; ++i)
        text += "k" + std::to_string(i) + "\nk" + std::to_string(i) + "\n";
    const Parsed found = read(text);
    CHECK(found.notes.size() < 40);
    std::uint64_t count = 0;
    for (const Note &note : found.notes)
        count += note.what.starts_with("keyword") ? note.count : 0;
    CHECK(count == 2000);
}

TEST_CASE("aCutFileNeverBreaksTheParser") {
    const std::string text =
        "\xef\xbb\xbfo a\nv 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nusemtl x\ns 1\n"
        "f 1/1/1 2/1/1 \\\r\n 3/1/1\nf -3//-1 -2//-1 -1//-1\nl 1 2\n# end \\";
    for (std::size_t length = 0; length <= text.size(); ++length) {
        const Parsed found = read(text.substr(0, length));
        for (const std::uint32_t vertex : found.triangles)
            CHECK(vertex < found.positions.size() / 3);
    }
    for (std::size_t at = 0; at < text.size(); ++at)
        for (const char byte : {'\0', '/', '-', '\\', '\n', '9', '\xff'}) {
            std::string changed = text;
            changed[at] = byte;
            const Parsed found = read(changed);
            for (const std::uint32_t vertex : found.triangles)
                CHECK(vertex < found.positions.size() / 3);
        }
}

TEST_CASE("changedTextNeverBreaksTheParserInMemoryOrInBlocks") {
    std::string text;
    for (int i = 1; i <= 60; ++i) {
        const std::string n = std::to_string(i);
        text +=
            "v 0." + n + " -" + n + ".25 1e-" + n + "\nvt 0." + n + " 1." + n + "\nvn 0 -0.5 0." + n + "\n";
        text += "f " + n + "/" + n + "/" + n + " 1/1/1 " + n + "//" + n + " 1\n";
    }
    std::uint64_t state = 1;
    const auto random = [&](std::size_t below) {
        state = state * 6364136223846793005ull + 1442695040888963407ull;
        return static_cast<std::size_t>(state >> 33) % below;
    };
    const std::string bytes = "\n\r \t/\\-.0123456789evtnf#\xff";
    for (int turn = 0; turn < 3000; ++turn) {
        std::string changed = text.substr(random(200), 1 + random(text.size()));
        for (std::size_t k = random(6); k > 0; --k)
            changed[random(changed.size())] = bytes[random(bytes.size())];
        // A copy without a byte to spare, so that a read beyond the text is seen.
        const std::vector<char> exact(changed.begin(), changed.end());
        const Parsed found = parse({exact.data(), exact.size()}, Limits{});
        for (const std::uint32_t vertex : found.triangles)
            REQUIRE(vertex < found.positions.size() / 3);
        if (turn % 50)
            continue;
        std::FILE *const file = std::tmpfile();
        REQUIRE(file);
        std::fwrite(exact.data(), 1, exact.size(), file);
        std::fflush(file);
        std::rewind(file);
        Parsed streamed;
        REQUIRE(parse_file(fileno(file), Limits{}, streamed));
        std::fclose(file);
        CHECK(std::ranges::equal(streamed.triangles, found.triangles));
        CHECK(std::ranges::equal(streamed.positions, found.positions));
        CHECK(streamed.fault_count == found.fault_count);
    }
}

TEST_CASE("cornersAtOnePositionAreSharedInListsAndInTheTable") {
    std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    constexpr std::uint32_t count = 3000;
    for (std::uint32_t i = 0; i < count; ++i)
        text += "vt 0." + std::to_string(10000 + i) + "\n";
    for (int twice = 0; twice < 2; ++twice)
        for (std::uint32_t i = 1; i <= count; ++i) {
            const std::string n = "/" + std::to_string(i);
            text += "f 1" + n + " 2" + n + " 3" + n + "\n";
        }
    const Parsed found = read(text);
    CHECK(found.positions.size() == count * 9);
    REQUIRE(found.triangles.size() == count * 6);
    CHECK(std::equal(found.triangles.begin(), found.triangles.begin() + count * 3,
                     found.triangles.begin() + count * 3));
}

TEST_CASE("tooManyElementsAreAFault") {
    Limits limits;
    limits.elements = 5;
    CHECK(parse("v 0 0 0\nv 0 0 0\nv 0 0 0\nv 0 0 0\nv 0 0 0\nv 0 0 0\n", limits).fault_count == 1);
}
