#include "streaming/terrain_cut.hpp"

#include <doctest/doctest.h>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <iterator>
#include <map>
#include <random>
#include <set>
#include <utility>
#include <vector>

using namespace paradize;

namespace {

using Corner = std::array<int, 2>;
using Corners = std::array<Corner, 3>; // the right angle first, then the ends of the hypotenuse

/// A complete tree over a flat square of `side` metres (a power of two). Errors and spheres are random and
/// not saturated, so that only the rule of the cut keeps it conforming.
struct Tree {
    assets::TerrainPatches patches;
    assets::TerrainDiamonds diamonds;
    std::vector<Corners> corners;
    int side;

    explicit Tree(int length, std::uint32_t seed) : side(length), random_(seed) {
        std::vector<std::pair<Corners, int>> level; // patches and their parent diamonds
        level.push_back({{{{side, 0}, {0, 0}, {side, side}}}, -1});
        level.push_back({{{{0, side}, {side, side}, {0, 0}}}, -1});
        for (std::uint32_t depth = 0; !level.empty(); ++depth) {
            std::map<Hypotenuse, int> shared; // patches on each hypotenuse, then its diamond or -1
            for (const auto &[at, maker] : level) {
                shared[hypotenuse(at)] += 1;
            }
            for (auto &[ends, patches_on_it] : shared) {
                const Corner middle = middle_of(ends.first, ends.second);
                const bool rim = middle[0] % side == 0 || middle[1] % side == 0;
                const bool whole = patches_on_it == (rim ? 1 : 2); // otherwise its neighbour was left out
                const bool finest = depth + 1 == static_cast<std::uint32_t>(
                                                     std::bit_width(static_cast<unsigned>(side * side)));
                patches_on_it = -1;
                if (whole && !finest && (depth < 3 || random_() % 64 != 0)) {
                    patches_on_it = static_cast<int>(diamonds.size());
                    add_diamond(depth, middle);
                }
            }
            std::vector<std::pair<Corners, int>> next;
            for (const auto &[at, maker] : level) {
                const int diamond = shared[hypotenuse(at)];
                add_patch(at, depth, maker, diamond);
                if (diamond >= 0) {
                    const Corner middle = middle_of(at[1], at[2]);
                    next.push_back({{{middle, at[0], at[1]}}, diamond});
                    next.push_back({{{middle, at[2], at[0]}}, diamond});
                }
            }
            level = std::move(next);
        }
    }

  private:
    using Hypotenuse = std::pair<Corner, Corner>;

    static Hypotenuse hypotenuse(const Corners &at) {
        return {std::min(at[1], at[2]), std::max(at[1], at[2])};
    }

    static Corner middle_of(const Corner &b, const Corner &c) {
        return {(b[0] + c[0]) / 2, (b[1] + c[1]) / 2};
    }

    float sample(float low, float high) {
        return low + (high - low) * static_cast<float>(random_() % 4096) / 4096.0F;
    }

    void add_diamond(std::uint32_t depth, const Corner &middle) {
        diamonds.level.push_back(depth);
        diamonds.error_m.push_back(sample(0.0F, 4.0F) / static_cast<float>(1U << (depth / 2)));
        diamonds.center.emplace_back(middle[1], 0.0F, middle[0]);
        diamonds.radius_m.push_back(sample(0.1F, 1.0F) * static_cast<float>(side) /
                                    static_cast<float>(1U << (depth / 2)));
    }

    void add_patch(const Corners &at, std::uint32_t depth, int maker, int diamond) {
        corners.push_back(at);
        patches.tile.push_back(0);
        patches.node.push_back(static_cast<std::uint32_t>(patches.node.size()));
        patches.level.push_back(depth);
        patches.parent_diamond.push_back(maker);
        patches.diamond.push_back(diamond);
        patches.center.emplace_back(at[0][1], 0.0F, at[0][0]);
        patches.radius_m.push_back(1.0F);
        patches.error_m.push_back(0.0F);
    }

    std::mt19937 random_;
};

/// The rule of FORMAT.md, applied diamond by diamond.
std::vector<std::uint32_t> expected_cut(const Tree &tree, const CutEye &eye,
                                        const std::vector<bool> &mark_resident) {
    const auto &[patches, diamonds, corners, side] =
        std::tie(tree.patches, tree.diamonds, tree.corners, tree.side);
    std::vector<bool> split(diamonds.size());
    for (std::size_t d = 0; d < diamonds.size(); ++d) {
        bool may = diamonds.error_m[d] * eye.pixels_at_1m >
                   eye.error_px * std::max(eye.near_m, glm::distance(eye.position, diamonds.center[d]) -
                                                           diamonds.radius_m[d]);
        for (std::size_t p = 0; p < patches.size(); ++p) {
            const int maker = patches.parent_diamond[p];
            if (patches.diamond[p] == static_cast<int>(d) && maker >= 0) {
                may = may && split[static_cast<std::size_t>(maker)];
            }
            may = may && (maker != static_cast<int>(d) || mark_resident[p]);
        }
        split[d] = may;
    }
    std::vector<std::uint32_t> out;
    for (std::size_t p = 0; p < patches.size(); ++p) {
        const int maker = patches.parent_diamond[p];
        const int diamond = patches.diamond[p];
        if (mark_resident[p] && (maker < 0 || split[static_cast<std::size_t>(maker)]) &&
            (diamond < 0 || !split[static_cast<std::size_t>(diamond)])) {
            out.push_back(static_cast<std::uint32_t>(p));
        }
    }
    return out;
}

int side_of(const Corner &a, const Corner &b, const Corner &p) {
    return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
}

/// True if every quarter of every unit cell lies in exactly one patch. Patches never cut a quarter, because
/// their edges are grid lines or cell diagonals.
bool covers_once(const Tree &tree, std::span<const std::uint32_t> cut) {
    // Scaled by six, the integer point at distance 1 from the cell's centre lies inside the quarter.
    const std::array<Corner, 4> quarters{{{1, 3}, {5, 3}, {3, 1}, {3, 5}}};
    std::vector<int> hits(static_cast<std::size_t>(tree.side * tree.side * 4));
    for (const std::uint32_t patch : cut) {
        Corners at = tree.corners[patch];
        Corner low{1 << 30, 1 << 30};
        Corner high{0, 0};
        for (Corner &corner : at) {
            for (std::size_t axis = 0; axis < 2; ++axis) {
                low[axis] = std::min(low[axis], corner[axis]);
                high[axis] = std::max(high[axis], corner[axis]);
                corner[axis] *= 6;
            }
        }
        for (int row = low[0]; row < high[0]; ++row) {
            for (int column = low[1]; column < high[1]; ++column) {
                for (std::size_t q = 0; q < 4; ++q) {
                    const Corner point{6 * row + quarters[q][0], 6 * column + quarters[q][1]};
                    const int a = side_of(at[0], at[1], point);
                    const int b = side_of(at[1], at[2], point);
                    const int c = side_of(at[2], at[0], point);
                    const bool inside = (a > 0 && b > 0 && c > 0) || (a < 0 && b < 0 && c < 0);
                    hits[static_cast<std::size_t>(row * tree.side + column) * 4 + q] += inside ? 1 : 0;
                }
            }
        }
    }
    return std::ranges::all_of(hits, [](int count) { return count == 1; });
}

/// True if no corner of a patch lies inside an edge of another patch.
bool conforms(const Tree &tree, std::span<const std::uint32_t> cut) {
    std::set<Corner> corners;
    for (const std::uint32_t patch : cut) {
        corners.insert(tree.corners[patch].begin(), tree.corners[patch].end());
    }
    for (const std::uint32_t patch : cut) {
        for (std::size_t i = 0; i < 3; ++i) {
            const Corner a = tree.corners[patch][i];
            const Corner b = tree.corners[patch][(i + 1) % 3];
            const int steps = std::max(std::abs(b[0] - a[0]), std::abs(b[1] - a[1]));
            for (int step = 1; step < steps; ++step) {
                if (corners.contains(
                        {a[0] + (b[0] - a[0]) * step / steps, a[1] + (b[1] - a[1]) * step / steps})) {
                    return false;
                }
            }
        }
    }
    return true;
}

} // namespace

TEST_CASE("terrain cut: covers every point once, conforms and follows the rule, whatever is resident") {
    for (std::uint32_t seed = 0; seed < 6; ++seed) {
        const Tree tree(32, seed);
        const auto count = static_cast<std::uint32_t>(tree.patches.size());
        REQUIRE(count > 500);
        TerrainCut cut(tree.patches, tree.diamonds);
        std::vector<bool> mark_resident(count);
        std::mt19937 random(seed);
        std::set<std::size_t> sizes;
        std::uint32_t next = 0;
        while (true) {
            for (int moment = 0; moment < 3; ++moment) {
                CutEye eye;
                eye.position = {static_cast<float>(random() % 48) - 8.0F, 1.0F,
                                static_cast<float>(random() % 48) - 8.0F};
                eye.pixels_at_1m = static_cast<float>(1U << (random() % 8));
                cut.update(eye);
                const std::vector<std::uint32_t> expected = expected_cut(tree, eye, mark_resident);
                REQUIRE(std::ranges::equal(cut.patches(), expected));
                sizes.insert(expected.size());
                if (next >= 2) {
                    CHECK(covers_once(tree, cut.patches()));
                    CHECK(conforms(tree, cut.patches()));
                } else {
                    CHECK(expected.size() == next);
                }
            }
            if (next == count) {
                break;
            }
            for (std::uint32_t few = next < 2 ? 1 : count / 9; few > 0 && next < count; --few) {
                mark_resident[next] = true;
                cut.mark_resident(next++);
            }
        }
        CHECK(cut.resident_count() == count);
        CHECK(sizes.size() > 8); // eye and resident patches made a difference
        for (std::uint32_t left = count - 2; left > count / 4;) { // evicted in any order, but for the roots
            for (std::uint32_t few = count / 9; few > 0; --few) {
                const std::uint32_t patch = 2 + static_cast<std::uint32_t>(random()) % (count - 2);
                if (mark_resident[patch]) {
                    mark_resident[patch] = false;
                    cut.mark_absent(patch);
                    --left;
                }
            }
            CutEye eye;
            eye.position = {static_cast<float>(random() % 32), 1.0F, static_cast<float>(random() % 32)};
            eye.pixels_at_1m = 128.0F;
            cut.update(eye);
            REQUIRE(std::ranges::equal(cut.patches(), expected_cut(tree, eye, mark_resident)));
            CHECK(covers_once(tree, cut.patches()));
            CHECK(conforms(tree, cut.patches()));
        }
    }
}

TEST_CASE("terrain cut: with diamonds that fade each dither value has a cut without holes and overlaps") {
    std::size_t partly = 0;
    for (std::uint32_t seed = 0; seed < 4; ++seed) {
        const Tree tree(32, seed);
        TerrainCut cut(tree.patches, tree.diamonds);
        TerrainCut plain(tree.patches, tree.diamonds);
        std::mt19937 random(seed);
        std::vector<bool> fading(tree.diamonds.size());
        for (std::size_t d = 0; d < fading.size(); ++d) {
            fading[d] = random() % 4 != 0;
        }
        cut.set_fading(fading);
        for (std::uint32_t patch = 0; patch < tree.patches.size(); ++patch) {
            if (patch < 64 || random() % 16 != 0) {
                cut.mark_resident(patch);
                plain.mark_resident(patch);
            }
        }
        for (int moment = 0; moment < 6; ++moment) {
            CutEye eye;
            eye.position = {static_cast<float>(random() % 48) - 8.0F, 1.0F,
                            static_cast<float>(random() % 48) - 8.0F};
            eye.pixels_at_1m = 4.0F + static_cast<float>(random() % 128);
            cut.update(eye);
            plain.update(eye);
            for (const float dither : {0.0F, 0.2F, 0.5F, 0.8F, 0.999F}) {
                std::vector<std::uint32_t> shown;
                std::ranges::copy_if(cut.patches(), std::back_inserter(shown),
                                     [&](std::uint32_t patch) { return cut.fade(patch).shows(dither); });
                CHECK(covers_once(tree, shown));
                CHECK(conforms(tree, shown));
            }
            for (std::uint32_t d = 0; d < tree.diamonds.size(); ++d) {
                CHECK((!plain.split(d) || cut.split(d))); // a fade never shows less than no fade
            }
            partly += static_cast<std::size_t>(std::ranges::count_if(
                cut.patches(), [&](std::uint32_t patch) { return cut.fade(patch) != PatchFade{}; }));
        }
    }
    CHECK(partly > 20);
}

TEST_CASE("terrain cut: a diamond that fades splits in steps as small as those of the eye") {
    const Tree tree(16, 2);
    TerrainCut cut(tree.patches, tree.diamonds);
    cut.set_fading(std::vector<bool>(tree.diamonds.size(), true));
    for (std::uint32_t patch = 0; patch < tree.patches.size(); ++patch) {
        cut.mark_resident(patch);
    }
    std::vector<PatchFade> before;
    float largest = 0.0F;
    bool begins = false;
    bool ends = false;
    for (int step = 0; step < 600; ++step) {
        // 0.5 % more of an error a step: 3.4 % of a fade
        cut.update({{7.0F, 60.0F, 7.0F}, 2.0F * std::pow(1.005F, static_cast<float>(step)), 0.5F, 1.0F});
        std::vector<PatchFade> now;
        for (std::uint32_t patch = 0; patch < tree.patches.size(); ++patch) {
            now.push_back(cut.fade(patch));
        }
        for (std::size_t patch = 0; !before.empty() && patch < now.size(); ++patch) {
            largest = std::max({largest, std::abs(now[patch].from - before[patch].from),
                                std::abs(now[patch].to - before[patch].to)});
            begins = begins || (now[patch].from > 0.0F && before[patch].from == 0.0F);
            ends = ends || (now[patch].from == 1.0F && before[patch].from < 1.0F);
        }
        before = std::move(now);
    }
    CHECK(begins);
    CHECK(ends);
    CHECK(largest < 0.04F);
}

TEST_CASE("terrain cut: these checks find a hole, an overlap and a hanging vertex") {
    const Tree tree(8, 1);
    CHECK(covers_once(tree, std::array<std::uint32_t, 2>{0, 1}));
    CHECK(conforms(tree, std::array<std::uint32_t, 2>{0, 1}));
    CHECK_FALSE(covers_once(tree, std::array<std::uint32_t, 1>{0}));
    CHECK_FALSE(covers_once(tree, std::array<std::uint32_t, 3>{0, 1, 2}));
    // One root, and the halves of the other.
    std::vector<std::uint32_t> broken_cut{1};
    for (std::uint32_t patch = 2; patch < 6; ++patch) {
        const Corners &at = tree.corners[patch];
        if (side_of({0, 0}, {8, 8}, at[1]) < 0 || side_of({0, 0}, {8, 8}, at[2]) < 0) {
            broken_cut.push_back(patch);
        }
    }
    CHECK(covers_once(tree, broken_cut));
    CHECK_FALSE(conforms(tree, broken_cut));
}

TEST_CASE("terrain cut: roots from far away, the finest from near, and the error limit holds in between") {
    const Tree tree(32, 3);
    TerrainCut cut(tree.patches, tree.diamonds);
    for (std::uint32_t patch = 0; patch < tree.patches.size(); ++patch) {
        cut.mark_resident(patch);
    }
    cut.update({{0.0F, 1e6F, 0.0F}, 500.0F, 0.5F, 1.0F});
    CHECK(cut.patches().size() == 2);
    cut.update({{8.0F, 0.0F, 8.0F}, 1e9F, 0.5F, 1.0F});
    for (const std::uint32_t patch : cut.patches()) {
        const int diamond = tree.patches.diamond[patch];
        CHECK((diamond < 0 || tree.diamonds.error_m[static_cast<std::size_t>(diamond)] == 0.0F));
    }
    // With everything resident, no diamond of the cut exceeds the accepted error.
    const CutEye eye{{3.0F, 2.0F, 5.0F}, 20.0F, 0.5F, 1.0F};
    cut.update(eye);
    std::size_t looked_at = 0;
    for (std::uint32_t d = 0; d < tree.diamonds.size(); ++d) {
        bool shown = true;
        for (std::size_t p = 0; p < tree.patches.size(); ++p) {
            const int maker = tree.patches.parent_diamond[p];
            shown = shown && (tree.patches.diamond[p] != static_cast<int>(d) || maker < 0 ||
                              cut.split(static_cast<std::uint32_t>(maker)));
        }
        if (shown && !cut.split(d)) {
            ++looked_at;
            const float distance_m = std::max(0.5F, glm::distance(eye.position, tree.diamonds.center[d]) -
                                                        tree.diamonds.radius_m[d]);
            CHECK(tree.diamonds.error_m[d] * 20.0F / distance_m <= 1.0F);
        }
    }
    CHECK(looked_at > 4);
}
