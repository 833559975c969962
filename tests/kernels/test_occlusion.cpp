// Occlusion kernels without Python: what the sanitizers see runs here.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include "occlusion/cast.hpp"
#include "occlusion/texels.hpp"
#include "reference/occlusion.hpp"

using namespace paradize;

namespace {

// Triangles all over the unit cube, by a generator of remainders.
struct Soup {
    std::vector<float> positions;
    std::vector<std::uint32_t> triangles;

    explicit Soup(std::uint32_t count) {
        std::uint32_t state = 12345;
        const auto next = [&] {
            state = state * 1664525U + 1013904223U;
            return static_cast<float>(state >> 8) / 16777216.0F;
        };
        for (std::uint32_t t = 0; t < count; ++t) {
            const std::array<float, 3> at{next(), next(), next()};
            for (std::uint32_t c = 0; c < 3; ++c) {
                for (std::size_t k = 0; k < 3; ++k) {
                    positions.push_back(at[k] - 0.5F + 0.2F * (next() - 0.5F));
                }
                triangles.push_back(3 * t + c);
            }
        }
    }
};

std::vector<float> cast(const occlusion::Tree &tree, std::size_t points, std::size_t rays, int threads,
                        int width) {
    std::vector<float> at, up, out(points);
    std::vector<std::uint32_t> texels;
    for (std::size_t i = 0; i < points; ++i) {
        const float along = static_cast<float>(i) / static_cast<float>(points) - 0.5F;
        at.insert(at.end(), {along, -along, 0.1F});
        up.insert(up.end(), {0, i % 2 == 0 ? 1.0F : 0.0F, i % 2 == 0 ? 0.0F : -1.0F});
        texels.push_back(static_cast<std::uint32_t>(i));
    }
    occlusion::cast_all(tree, at, up, up, texels, 8, occlusion::make_directions(rays), 0.5F, out, threads,
                        width);
    return out;
}

} // namespace

TEST_CASE("rays meet the same triangles whatever the threads and the width") {
    const Soup soup(500);
    const auto tree = occlusion::build_tree(soup.positions, soup.triangles);
    const auto wanted = cast(tree, 600, 64, 1, 1);
    CHECK(*std::min_element(wanted.begin(), wanted.end()) < 0.5F);
    CHECK(*std::max_element(wanted.begin(), wanted.end()) > 0.5F);
    for (const int width : {0, 2, 3}) {
        if (occlusion::has_width(width)) {
            CHECK(cast(tree, 600, 64, 4, width) == wanted);
        }
    }
}

TEST_CASE("a tree of no triangles, of one, and of many at one place") {
    for (const std::uint32_t count : {0U, 1U, 5000U}) {
        Soup soup(count > 0 ? 1 : 0);
        for (std::uint32_t t = 1; t < count; ++t) {
            soup.triangles.insert(soup.triangles.end(), {0U, 1U, 2U});
        }
        soup.triangles.insert(soup.triangles.end(), {0U, 0U, 0U}); // without an area
        if (count == 0) {
            soup.positions.resize(3);
        }
        const auto tree = occlusion::build_tree(soup.positions, soup.triangles);
        CHECK(tree.corners.size() == count);
        for (const float share : cast(tree, 40, 16, 2, 0)) {
            CHECK(share >= 0.0F);
            CHECK(share <= 1.0F);
        }
    }
}

TEST_CASE("directions are unit, above the surface, and another set for each texel of a block") {
    const auto made = occlusion::make_directions(64);
    std::array<bool, occlusion::sets> seen{};
    for (std::size_t y = 0; y < occlusion::block_side; ++y) {
        for (std::size_t x = 0; x < occlusion::block_side; ++x) {
            seen[occlusion::set_of(y + 16, x + 8)] = true;
        }
    }
    CHECK(std::count(seen.begin(), seen.end(), true) == occlusion::sets);
    double height = 0;
    for (std::size_t i = 0; i < made.x.size(); ++i) {
        CHECK(std::fabs(made.x[i] * made.x[i] + made.y[i] * made.y[i] + made.z[i] * made.z[i] - 1) < 1e-6);
        CHECK(made.z[i] > 0);
        height += made.z[i];
    }
    CHECK(height / static_cast<double>(made.x.size()) ==
          doctest::Approx(2.0 / 3).epsilon(1e-4)); // of a cosine
}

TEST_CASE("texels beside a sliver, on a line and beyond the edge of the map have a place") {
    const std::vector<float> uvs{0.1F,  0.1F, 0.9F,  0.1001F, 0.5F, 0.1002F,
                                 0.95F, 0.5F, 1.05F, 0.5F,    1.0F, 0.9F};
    const std::vector<std::uint32_t> triangles{0, 1, 2, 3, 4, 5, 0, 1, 1};
    std::vector<std::int32_t> touched(64, -1);
    touched[0] = 0;
    touched[9] = 2;
    touched[63] = 1;
    const auto found = occlusion::places_of(uvs, triangles, touched, 8, 8, 1000);
    CHECK(found.texel.size() >= 3);
    for (std::size_t i = 0; i < found.texel.size(); ++i) {
        const double sum = found.weights[3 * i] + found.weights[3 * i + 1] + found.weights[3 * i + 2];
        CHECK(sum == doctest::Approx(1));
        CHECK(found.texel[i] < 64);
    }
    CHECK_THROWS_AS(occlusion::places_of(uvs, triangles, touched, 8, 8, 1), std::length_error);
}

TEST_CASE("brute force sees through nothing") {
    // A tetrahedron about the point.
    const std::vector<double> p{-1, -1, -1, 3, -1, -1, -1, 3, -1, -1, -1, 3};
    std::vector<double> corners;
    for (const auto &face : {std::array{0, 1, 2}, {0, 1, 3}, {0, 2, 3}, {1, 2, 3}}) {
        for (const int v : face) {
            corners.insert(corners.end(), &p[3 * static_cast<std::size_t>(v)],
                           &p[3 * static_cast<std::size_t>(v)] + 3);
        }
    }
    const std::vector<double> at{0, 0, 0}, up{0, 0.6, 0.8};
    std::vector<double> out(1);
    reference::open_shares(at, up, up, corners, 100, 200, out, 1);
    CHECK(out[0] == 0);
    reference::open_shares(at, up, up, std::span(corners).first(9), 100, 200, out, 1);
    CHECK(out[0] > 0.5);
}
