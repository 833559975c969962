// Runs of plain OBJ lines: every way to read them gives the same values and stops at the same line.
#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "obj/lines.hpp"
#include "obj/marks.hpp"
#include "obj/parse.hpp"

using namespace paradize::obj;

namespace {

struct Marked {
    std::string text;
    std::vector<std::uint64_t> breaks, ends;

    explicit Marked(std::string lines) : text(std::move(lines)) {
        text.append(256, '\n');
        const std::size_t words = text.size() / 64;
        breaks.assign(words + 2, 0);
        ends.assign(words, 0);
        mark(text.data(), words, breaks.data(), ends.data());
    }
    Lines lines(std::size_t length) const {
        const char *const p = text.data();
        return {p,           p + length,     p + text.size() - line_slack,
                p,           breaks.data(),  ends.data(),
                ends.size(), std::size_t{0}, ends[0]};
    }
};

std::string some_number(std::mt19937 &random) {
    static const char *const forms[] = {"%.6f", "%.2f", "%.8f", "%g", "%.0f", "%.1f", "%.3e", "%.12f"};
    const double value = std::ldexp(std::uniform_real_distribution<>(-1, 1)(random), int(random() % 30) - 5);
    char text[64];
    std::snprintf(text, sizeof text, forms[random() % 16 < 10 ? 0 : random() % 8], value);
    return text;
}

} // namespace

TEST_CASE("marksAreThoseOfEachByteByItself") {
    std::mt19937 random(3);
    std::string text;
    for (int i = 0; i < 64 * 37; ++i)
        text += i < 256 ? static_cast<char>(i) : "0123456789 \n./-"[random() % 15];
    std::vector<std::uint64_t> breaks(37), ends(37);
    mark(text.data(), 37, breaks.data(), ends.data());
    for (std::size_t i = 0; i < text.size(); ++i) {
        CHECK((breaks[i / 64] >> i % 64 & 1) == std::uint64_t{text[i] < '0' || text[i] > '9'});
        CHECK((ends[i / 64] >> i % 64 & 1) == std::uint64_t{text[i] == '\n'});
    }
}

namespace {

template <typename Real>
void wide_and_plain_agree(NumberReader<Real> *LineReaders::*kind, const char *keyword) {
    const LineReaders *const wide = wide_readers();
    if (!wide)
        return;
    std::mt19937 random(5);
    std::size_t taken = 0;
    for (int turn = 0; turn < 4000; ++turn) {
        std::string text;
        for (int line = 0; line < 8; ++line) {
            text += keyword;
            for (int k = 0; k < 3; ++k)
                text += std::string(1 + (random() % 8 == 0), ' ') + some_number(random);
            text += random() % 8 == 0 ? " \r\n" : "\n";
        }
        if (turn % 2 == 0)
            text[random() % text.size()] = "0123456789 \n\r./-+ev\\#"[random() % 22];
        const Marked marked(text);
        Lines a = marked.lines(text.size()), b = a;
        // Bytes of a line that is not taken may lie there already.
        std::vector<Real> x(128, -1), y(128, -1);
        const std::size_t n = (wide->*kind)(a, ~std::size_t{0}, x.data());
        const std::size_t m = (plain_readers.*kind)(b, n, y.data());
        CHECK(m == n);
        CHECK(a.p == b.p);
        CHECK(std::memcmp(x.data(), y.data(), 3 * sizeof(Real) * n) == 0);
        taken += n;
    }
    CHECK(taken > 4000);
}

} // namespace

TEST_CASE("wideAndPlainReadersOfNumbersAgreeAndWideOnesStopNoLater") {
    wide_and_plain_agree(&LineReaders::normals, "vn");
    wide_and_plain_agree(&LineReaders::positions, "v");
}

TEST_CASE("wideAndPlainReadersOfFacesAgreeAndRefuseIndicesThatAreNotThere") {
    const LineReaders *const wide = wide_readers();
    if (!wide)
        return;
    std::mt19937 random(7);
    const std::uint32_t have[3] = {12345678, 900, 70000};
    std::size_t taken = 0;
    for (int turn = 0; turn < 4000; ++turn) {
        std::string text;
        for (int line = 0; line < 8; ++line) {
            text += "f";
            const std::size_t corners = 3 + random() % 3;
            for (std::size_t k = 0; k < corners; ++k) {
                text += ' ';
                for (int kind = 0; kind < 3; ++kind) {
                    const std::uint32_t most = have[kind] + (random() % 400 == 0);
                    const std::uint32_t least = random() % 400 == 0 ? 0 : 1;
                    text += (kind ? "/" : "") +
                            std::to_string(random() % 9 == 0 ? most : least + random() % (most - least + 1));
                }
            }
            text += '\n';
        }
        if (turn % 2 == 0)
            text[random() % text.size()] = "0123456789 \n\r./-+ev\\#"[random() % 22];
        const Marked marked(text);
        Lines a = marked.lines(text.size()), b = a;
        std::vector<Corner> x(400), y(400);
        std::vector<Face> p(64), q(64);
        Corner *xs = x.data(), *ys = y.data();
        const std::size_t n = wide->faces(a, ~std::size_t{0}, have, 1, xs, p.data());
        const std::size_t m = plain_readers.faces(b, n, have, 1, ys, q.data());
        CHECK(m == n);
        CHECK(a.p == b.p);
        CHECK(xs - x.data() == ys - y.data());
        CHECK(std::equal(x.data(), xs, y.data()));
        CHECK(std::memcmp(p.data(), q.data(), n * sizeof(Face)) == 0);
        for (const Corner *c = x.data(); c != xs; ++c)
            CHECK((c->position < have[0] && c->uv < have[1] && c->normal < have[2]));
        taken += n;
    }
    CHECK(taken > 4000);
}

TEST_CASE("oddLinesAmongPlainOnesAreReadWhereverBlocksOfMarksEnd") {
    for (const std::size_t length : {1, 63, 64, 65, 500, 16383, 16384, 16385, 40000}) {
        std::string text = "#" + std::string(length, 'x') + "\n";
        for (int i = 0; i < 3000; ++i)
            text += "v " + std::to_string(i) + ".5 0.25 -1.0\n" + (i % 97 == 0 ? "s off\n" : "");
        text += "f 1 2 3\nf 2998 2999 3000\n";
        const Parsed read = parse(text, {});
        CHECK(read.fault_count == 0);
        CHECK(read.positions_in_file == 3000);
        REQUIRE(read.triangles.size() == 6);
        CHECK(read.positions[0] == 0.5f);
        CHECK(read.positions[3 * 5] == 2999.5f);
        CHECK(read.triangle_lines[1] == std::ranges::count(text, '\n'));
    }
}
