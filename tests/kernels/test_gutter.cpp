// Gutter kernels without Python: what the sanitizers see runs here.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "gutter/walk.hpp"
#include "maps/gutter.hpp"

using namespace paradize;

namespace {

constexpr std::size_t rows = 12;
constexpr std::size_t columns = 17;

std::vector<gutter::LevelBleed> walked(const std::vector<const float *> &levels, std::size_t channels,
                                       gutter::Kind kind, const gutter::Layout &layout,
                                       std::span<const double> reach, int threads) {
    return gutter::walk({levels, rows, columns, channels}, kind, layout,
                        gutter::border_of(layout, rows, columns), reach, threads);
}

// Two islands, `gap` texels apart, of height 6; a chain of one channel that holds `left`, `right` and,
// between them, `between`.
struct Pair {
    std::vector<std::uint8_t> inside = std::vector<std::uint8_t>(rows * columns);
    std::vector<std::int32_t> ids = std::vector<std::int32_t>(rows * columns, -1);
    std::vector<std::int32_t> source = std::vector<std::int32_t>(rows * columns);
    std::vector<std::int32_t> owner = std::vector<std::int32_t>(rows * columns);
    std::vector<float> texels;
    bool repeat;

    Pair(std::size_t gap, float left, float right, float between, bool around) : repeat(around) {
        for (std::size_t y = 3; y < 9; ++y) {
            for (std::size_t x = 2; x < 6 + gap + 4; ++x) {
                if (x < 6 || x >= 6 + gap) {
                    ids[y * columns + x] = x < 6 ? 0 : 1;
                    inside[y * columns + x] = 1;
                }
            }
        }
        maps::nearest_covered(inside, rows, columns, repeat, repeat, source, 1);
        for (std::size_t i = 0; i < owner.size(); ++i) {
            owner[i] = ids[static_cast<std::size_t>(source[i])];
            texels.push_back(owner[i] == 0 ? left : right);
            if (inside[i] == 0) {
                texels.back() = between;
            }
        }
    }

    gutter::Layout layout() const { return {inside, source, owner, repeat}; }

    gutter::LevelBleed walk(double reach) const {
        const std::array<double, 2> far{reach, reach};
        return walked({texels.data()}, 1, gutter::Kind::value, layout(), far, 2).at(0);
    }
};

} // namespace

TEST_CASE("gutter: the gap is the texels between two islands, over the edge too where the map repeats") {
    std::array<std::int64_t, 2> pair{};
    for (const std::size_t gap : {std::size_t{1}, std::size_t{3}, std::size_t{5}}) {
        const Pair islands(gap, 0.0F, 1.0F, 0.5F, false);
        CHECK(gutter::smallest_gap(islands.layout(), rows, columns, pair) == static_cast<double>(gap));
        CHECK(islands.owner[static_cast<std::size_t>(pair[0])] !=
              islands.owner[static_cast<std::size_t>(pair[1])]);
    }
    const Pair around(5, 0.0F, 1.0F, 0.5F, true);
    CHECK(gutter::smallest_gap(around.layout(), rows, columns, pair) == 4.0); // 17 - 15 to the right, 2 left
}

TEST_CASE("gutter: islands side by side are one, and a texel between them is enough to part them") {
    for (const std::size_t gap : {std::size_t{0}, std::size_t{1}}) {
        const Pair islands(gap, 0.0F, 1.0F, 0.5F, false);
        const auto names = gutter::touching(islands.ids, rows, columns, 2, false);
        CHECK((names[0] == names[1]) == (gap == 0));
    }
}

TEST_CASE("gutter: a wrong gutter is seen, a right one is not, and the reach decides how far") {
    CHECK(Pair(4, 0.25F, 0.25F, 0.25F, false).walk(0.0).worst == 0.0);
    CHECK(Pair(4, 0.25F, 0.25F, 1.0F, false).walk(0.0).worst == doctest::Approx(0.75));
    const Pair filled = [] {
        Pair islands(6, 0.25F, 1.0F, 0.0F, false);
        for (std::size_t i = 0; i < islands.owner.size(); ++i) {
            islands.texels[i] = islands.owner[i] == 0 ? 0.25F : 1.0F;
        }
        return islands;
    }();
    CHECK(filled.walk(0.0).worst == 0.0);
    CHECK(filled.walk(1.0 / columns).worst == 0.0); // one texel further: still its own half of the gap
    CHECK(filled.walk(6.0 / columns).worst == doctest::Approx(0.75));
    CHECK(filled.walk(6.0 / columns).own < 0.5);
}

TEST_CASE("gutter: an island of negative reach is not walked, and without islands nothing is found") {
    const Pair islands(4, 0.0F, 1.0F, 0.5F, true);
    const std::array<double, 2> none{-1.0, -1.0};
    const auto found = walked({islands.texels.data()}, 1, gutter::Kind::value, islands.layout(), none, 3);
    CHECK(found.at(0).samples == 0);
    CHECK(found.at(0).worst == 0.0);
}

TEST_CASE("gutter: every kind of value walks a whole chain down to one texel") {
    const Pair islands(3, 0.2F, 0.7F, 0.0F, false);
    const std::array<double, 2> far{0.3, 0.0};
    for (const auto &[kind, channels] : {std::pair{gutter::Kind::value, std::size_t{1}},
                                         {gutter::Kind::color, std::size_t{3}},
                                         {gutter::Kind::color, std::size_t{4}},
                                         {gutter::Kind::normal, std::size_t{2}}}) {
        std::vector<std::vector<float>> chain;
        for (std::size_t h = rows, w = columns;;
             h = std::max<std::size_t>(1, h / 2), w = std::max<std::size_t>(1, w / 2)) {
            std::vector<float> &texels = chain.emplace_back(h * w * channels);
            for (std::size_t i = 0; i < texels.size(); ++i) {
                texels[i] = static_cast<float>((i + chain.size()) * 31 % 97) / 140.0F;
            }
            if (h == 1 && w == 1) {
                break;
            }
        }
        const std::size_t levels = chain.size();
        std::vector<const float *> texels;
        for (const std::vector<float> &level : chain) {
            texels.push_back(level.data());
        }
        const auto one = walked(texels, channels, kind, islands.layout(), far, 1);
        const auto many = walked(texels, channels, kind, islands.layout(), far, 5);
        REQUIRE(one.size() == levels);
        for (std::size_t level = 0; level < levels; ++level) {
            CHECK(one[level].worst == many[level].worst);
            CHECK(one[level].all_p99 == many[level].all_p99);
            CHECK(one[level].worst <= 1.0);
            CHECK(one[level].all_p99 <= one[level].worst);
        }
    }
}
