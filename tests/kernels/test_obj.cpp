// OBJ text without Python: what is read, what is told, and that nothing breaks the parser.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include "obj_number.hpp"
#include "obj_parse.hpp"
#include "obj_triangulate.hpp"

using namespace paradize::obj;

namespace {

Parsed read(const std::string &text) {
    return parse(text, Limits{});
}

float number(const std::string &text, NumberFault expected = NumberFault::none) {
    const char *p = text.data();
    float value = -1;
    CHECK(read_float(p, text.data() + text.size(), value) == expected);
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
    std::uint64_t told = 0;
    for (const Note &note : found.notes)
        told += note.what.starts_with("keyword") ? note.count : 0;
    CHECK(told == 2000);
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

TEST_CASE("tooManyElementsAreAFault") {
    Limits limits;
    limits.elements = 5;
    CHECK(parse("v 0 0 0\nv 0 0 0\nv 0 0 0\nv 0 0 0\nv 0 0 0\nv 0 0 0\n", limits).fault_count == 1);
}
