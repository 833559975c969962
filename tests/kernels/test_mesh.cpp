// Mesh kernels without Python: tangent frames, normals, topology, places on the original surface, distances.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

#include "mesh/normals.hpp"
#include "mesh/project.hpp"
#include "mesh/tangents/tangents.hpp"
#include "mesh/topology.hpp"
#include "mesh/triangle_tree.hpp"
#include "mesh/weld.hpp"
#include "reference/bound.hpp"
#include "reference/distance.hpp"
#include "reference/frames.hpp"

using namespace paradize;

namespace {

struct Soup {
    std::vector<float> positions, normals, uvs;
    std::vector<std::uint32_t> triangles;
};

// A square in the ground plane in n x n quads; the image's rows run from -Z to +Z.
Soup ground(std::uint32_t n) {
    Soup out;
    for (std::uint32_t z = 0; z <= n; ++z)
        for (std::uint32_t x = 0; x <= n; ++x) {
            const float u = static_cast<float>(x) / static_cast<float>(n),
                        v = static_cast<float>(z) / static_cast<float>(n);
            out.positions.insert(out.positions.end(), {u, 0, v});
            out.normals.insert(out.normals.end(), {0, 1, 0});
            out.uvs.insert(out.uvs.end(), {u, v});
        }
    for (std::uint32_t z = 0; z < n; ++z)
        for (std::uint32_t x = 0; x < n; ++x) {
            const std::uint32_t a = z * (n + 1) + x, b = a + n + 1;
            out.triangles.insert(out.triangles.end(), {a, b, b + 1, a, b + 1, a + 1});
        }
    return out;
}

std::vector<float> tangents(const Soup &soup) {
    const mesh::SplitTangents split = mesh::split_tangents(
        {soup.positions, soup.normals, soup.uvs, soup.triangles}, mesh::Method::mikktspace, 1);
    std::vector<float> out;
    for (const std::uint32_t vertex : split.index) {
        const mesh::Frame &frame = split.frames[vertex];
        out.insert(out.end(), {frame.x, frame.y, frame.z, frame.w});
    }
    return out;
}

} // namespace

TEST_CASE("groundHasTAlongXAndBUpTheImage") {
    const auto found = tangents(ground(3));
    for (std::size_t c = 0; c < found.size(); c += 4) {
        CHECK(found[c] == doctest::Approx(1));
        CHECK(found[c + 3] == 1.0f);
    }
}

TEST_CASE("framesAreUnitAndAtRightAnglesWhateverTheImage") {
    std::uint32_t state = 7;
    for (int round = 0; round < 50; ++round) {
        Soup soup = ground(4);
        for (float &x : soup.uvs) {
            state = state * 1664525u + 1013904223u;
            x = round % 3 == 0 ? 0.5f : static_cast<float>(state >> 28) / 4;
        }
        const auto found = tangents(soup);
        for (std::size_t c = 0; c < found.size(); c += 4) {
            const double length = std::hypot(found[c], found[c + 1], found[c + 2]);
            CHECK(length == doctest::Approx(1).epsilon(1e-6));
            CHECK(std::fabs(found[c + 1]) < 1e-6);
            CHECK(std::fabs(found[c + 3]) == 1.0f);
        }
    }
}

TEST_CASE("theOrderOfTrianglesChangesNoFrame") {
    Soup soup = ground(3);
    for (std::size_t i = 0; i < soup.uvs.size(); i += 2)
        soup.uvs[i] = soup.uvs[i] * soup.uvs[i] + 0.3f * soup.uvs[i + 1];
    const auto before = tangents(soup);
    Soup turned = soup;
    const std::size_t count = soup.triangles.size() / 3;
    for (std::size_t t = 0; t < count; ++t)
        for (std::size_t k = 0; k < 3; ++k)
            turned.triangles[(count - 1 - t) * 3 + k] = soup.triangles[t * 3 + k];
    const auto after = tangents(turned);
    for (std::size_t t = 0; t < count; ++t)
        for (std::size_t k = 0; k < 12; ++k)
            CHECK(after[(count - 1 - t) * 12 + k] == doctest::Approx(before[t * 12 + k]).epsilon(1e-6));
}

TEST_CASE("normalsOfAFlatGroundPointUp") {
    const Soup soup = ground(3);
    std::vector<std::uint32_t> places(soup.positions.size() / 3), smoothing(soup.triangles.size() / 3, 1);
    std::iota(places.begin(), places.end(), 0u);
    std::vector<float> out(soup.triangles.size() * 3);
    mesh::corner_normals(soup.positions, places, soup.triangles, smoothing, 45, out);
    for (std::size_t c = 0; c < out.size(); c += 3)
        CHECK(out[c + 1] == 1.0f);
}

TEST_CASE("topologyCountsBordersAndIslands") {
    const Soup soup = ground(3);
    const auto found = mesh::topology(soup.triangles, 16);
    CHECK(found.border.count == 12);
    CHECK(found.edges == 33);
    CHECK(found.components == 1);
    CHECK(found.non_manifold.count == 0);
    CHECK(found.turned.count == 0);
    const std::vector<std::uint32_t> tie = {0, 1, 2, 0, 3, 4};
    const auto two = mesh::topology(tie, 5);
    CHECK(two.components == 2);
    CHECK(two.bow_tie.count == 1);
    CHECK(two.island == std::vector<std::uint32_t>{0, 0, 0, 0, 0});
}

TEST_CASE("placesOfAMeshOnItselfAreItsOwnCorners") {
    const Soup soup = ground(4);
    const std::vector<std::uint32_t> charts(soup.triangles.size() / 3, 0);
    const auto found =
        mesh::project(soup.positions, soup.triangles, charts, soup.positions, soup.triangles, false);
    for (std::size_t c = 0; c < soup.triangles.size(); ++c) {
        double u = 0, v = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            u += found.weights[c * 3 + k] * soup.uvs[soup.triangles[found.triangle[c] * 3 + k] * 2];
            v += found.weights[c * 3 + k] * soup.uvs[soup.triangles[found.triangle[c] * 3 + k] * 2 + 1];
        }
        CHECK(u == doctest::Approx(soup.uvs[soup.triangles[c] * 2]));
        CHECK(v == doctest::Approx(soup.uvs[soup.triangles[c] * 2 + 1]));
    }
}

TEST_CASE("theNearestTriangleIsFoundAmongNeedles") {
    // A fan of thin triangles, slanted against all axes.
    Soup fan;
    fan.positions = {0, 0, 0};
    for (int i = 0; i <= 300; ++i) {
        const float a = 0.001f * static_cast<float>(i);
        fan.positions.insert(fan.positions.end(), {100 - a, 80 + a, 50 + a * a});
        if (i > 0)
            fan.triangles.insert(fan.triangles.end(),
                                 {0, static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(i + 1)});
    }
    const TriangleTree tree(fan.positions, fan.triangles);
    std::vector<std::uint32_t> room;
    for (std::uint32_t wanted = 0; wanted < 300; wanted += 17) {
        const auto &c = tree.corners(wanted);
        const TriangleTree::Point middle{(c[1][0] + c[2][0]) / 2, (c[1][1] + c[2][1]) / 2,
                                         (c[1][2] + c[2][2]) / 2};
        double best = 1e300;
        std::uint32_t found = 0;
        int looked = 0;
        tree.search(middle, best, room, [&](std::uint32_t t) {
            const auto &d = tree.corners(t);
            double sum = 0;
            for (std::size_t k = 0; k < 3; ++k) {
                const double gap = (d[1][k] + d[2][k]) / 2 - middle[k];
                sum += gap * gap;
            }
            ++looked;
            if (sum < best) {
                best = sum;
                found = t;
            }
        });
        CHECK(found == wanted);
        CHECK(looked < 100);
    }
}

TEST_CASE("distanceOfParallelSquaresIsTheirGap") {
    const Soup soup = ground(2);
    std::vector<float> lifted = soup.positions;
    for (std::size_t i = 1; i < lifted.size(); i += 3)
        lifted[i] += 0.25f;
    const auto found =
        reference::one_sided({soup.positions, soup.triangles}, {lifted, soup.triangles}, 500, 2);
    CHECK(found.max == doctest::Approx(0.25));
    CHECK(found.rms == doctest::Approx(0.25));
    CHECK(found.p99 == doctest::Approx(0.25));
}

TEST_CASE("aSearchThatIsCutShortStillBoundsTheDistance") {
    // One triangle under a hill of many; no sample is looked at.
    Soup hill = ground(12);
    for (std::size_t i = 0; i < hill.positions.size(); i += 3) {
        const float x = hill.positions[i], z = hill.positions[i + 2];
        hill.positions[i + 1] = x * (1 - x) * z * (1 - z);
    }
    const std::vector<float> corners = {0, 0, 0, 0, 0, 1, 1, 0, 0};
    const std::vector<std::uint32_t> one = {0, 1, 2};
    const reference::Tree from({corners, one}), to({hill.positions, hill.triangles});
    const std::vector<std::uint32_t> near = {0};
    const auto close = reference::farthest(from, to, near, 0, {1e-3, 0, 50'000'000}, 2);
    CHECK(close.most <= 1.001 * close.least);
    reference::Bounds last{0, 1e30};
    for (const std::uint64_t tests : {0, 300, 3'000, 30'000}) {
        const auto found = reference::farthest(from, to, near, 0, {1e-3, 0, tests}, 2);
        CHECK(found.least <= close.most);
        CHECK(found.most >= close.least);
        CHECK(found.most <= last.most);
        CHECK(found.least >= last.least);
        last = found;
    }
}

TEST_CASE("aSearchOverNeedlesThatMeetCountsTheTrianglesThatItTests") {
    // A part of a disc: a look-up of a place tests most of the needles.
    const auto fan = [](std::uint32_t count) {
        Soup soup;
        soup.positions = {0, 0, 0};
        for (std::uint32_t i = 0; i <= count; ++i) {
            const double angle = 1.5 * i / count;
            soup.positions.insert(soup.positions.end(), {static_cast<float>(std::cos(angle)), 0,
                                                         static_cast<float>(std::sin(angle))});
            if (i > 0)
                soup.triangles.insert(soup.triangles.end(), {0, i, i + 1});
        }
        return soup;
    };
    const Soup fine = fan(400), coarse = fan(300);
    const reference::Tree from({fine.positions, fine.triangles}), to({coarse.positions, coarse.triangles});
    const std::vector<std::uint32_t> near(400, 0);
    const auto short_of = [&](std::uint64_t tests) {
        return reference::farthest(from, to, near, 0, {1e-6, 0, tests}, 2).most;
    };
    CHECK(short_of(0) == doctest::Approx(std::sin(1.5)).epsilon(0.01)); // from its end to the first needle
    CHECK(short_of(48'000) > 0.1);
    CHECK(short_of(480'000) < 0.002);
    CHECK(short_of(480'000) > 1e-5);
    CHECK(short_of(4'000'000) < 1e-5);
}

TEST_CASE("anglesAreRightAtBothEnds") {
    const std::vector<float> a = {1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0},
                             b = {1, 1e-6f, 0, -2, 0, 0, 0, 3, 0, 1, 0, 0};
    std::vector<double> out(4);
    reference::angles_deg(a, b, out);
    CHECK(out[0] == doctest::Approx(5.729577951e-5).epsilon(1e-6));
    CHECK(out[1] == doctest::Approx(180));
    CHECK(out[2] == doctest::Approx(90));
    CHECK(out[3] == 90);
}

TEST_CASE("weldedPointsGoToTheNearestEarlierOneThatStays") {
    const std::vector<float> points = {0, 0, 0, 1, 0, 0, 0.4f, 0, 0, 0.75f, 0, 0, 1e30f, 0, 0};
    CHECK(paradize::mesh::weld(points, 0.5) == std::vector<std::uint32_t>{0, 1, 0, 1, 4});
    CHECK(paradize::mesh::weld(points, 1e-30) == std::vector<std::uint32_t>{0, 1, 2, 3, 4});
    CHECK(paradize::mesh::weld({}, 1).empty());
}
