// Pictures of meshes: what is covered, what is nearest, and odd triangles.
#include <doctest/doctest.h>

#include <array>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "reference/seen.hpp"

using namespace paradize::reference;

namespace {

struct Model {
    std::vector<float> positions, normals, tangents, uvs;
    std::vector<std::uint32_t> triangles, rows;
    std::vector<SeenMaterial> materials{{}};

    SeenMesh mesh() const {
        return {{positions, triangles}, {triangles, normals, tangents, uvs}, rows, materials};
    }
    void add(std::initializer_list<float> corners) {
        for (const float value : corners) {
            positions.push_back(value);
        }
        const auto first = static_cast<std::uint32_t>(positions.size() / 3 - 3);
        triangles.insert(triangles.end(), {first, first + 1, first + 2});
        rows.push_back(0);
    }
};

constexpr std::array<double, 3> front{0, 0, 1};

SeenDifference seen(const Model &a, const Model &b, double pixel, std::size_t tiles = 1000) {
    return seen_differences(a.mesh(), b.mesh(), front, pixel, 4, tiles, {}, 3).back();
}

} // namespace

TEST_CASE("the area of a triangle is covered, whatever lies behind it") {
    Model one, two;
    one.add({0, 0, 0, 4, 0, 0, 0, 4, 0});
    two.add({0, 0, 0, 4, 0, 0, 0, 4, 0});
    two.add({0, 0, -1, 2, 0, -1, 0, 2, -1});
    const SeenDifference found = seen(one, two, 0.05);
    CHECK(found.covered == doctest::Approx(8 / (0.05 * 0.05)).epsilon(0.01));
    CHECK(found.changed == 0);
    CHECK(found.max == doctest::Approx(0));
}

TEST_CASE("triangles that are points, lines, huge or seen from behind do no harm") {
    Model plain, odd;
    plain.add({0, 0, 0, 1, 0, 0, 0, 1, 0});
    odd.add({0, 0, 0, 1, 0, 0, 0, 1, 0});
    odd.add({0.5F, 0.5F, 1, 0.5F, 0.5F, 1, 0.5F, 0.5F, 1});
    odd.add({0, 0, 1, 0.5F, 0.5F, 1, 1, 1, 1});
    odd.add({0, 0, 1, 0, 1, 1, 1, 0, 1});
    odd.add({0, 0, 1, 1e-38F, 0, 1, 0, 1e-38F, 1});
    CHECK(seen(plain, odd, 0.01).changed == 0);
}

TEST_CASE("any mesh at any size stays inside its arrays") {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> place(-1, 1);
    std::vector<float> vectors(4 * 2 * 3, 0.5F), alpha(3 * 5, 0.6F);
    for (const double pixel : {3.0, 0.3, 0.021, 0.0013}) {
        Model a, b;
        for (Model *model : {&a, &b}) {
            for (int t = 0; t < 40; ++t) {
                model->add({place(random), place(random), place(random), place(random), place(random),
                            place(random), place(random), place(random), place(random)});
            }
            for (std::size_t k = 0; k < model->positions.size() / 3; ++k) {
                model->normals.insert(model->normals.end(), {place(random), place(random), place(random)});
                model->tangents.insert(model->tangents.end(),
                                       {place(random), place(random), place(random), 1});
                model->uvs.insert(model->uvs.end(), {place(random) * 1e9F, place(random) * 3});
            }
            model->materials = {{{{vectors, 4, 2}, {std::span(vectors).first(6), 1, 2}},
                                 {{alpha, 3, 5}},
                                 {{vectors, 4, 2}},
                                 {},
                                 0.5,
                                 Wrap::repeat,
                                 Wrap::mirror,
                                 true}};
        }
        const SeenDifference found = seen(a, b, pixel, 50);
        CHECK(found.p99 <= 180);
        CHECK(found.mean <= found.max);
    }
}
