// Tangent kernels without Python: beside the float64 reference, on faces of every kind, with any threads.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "mesh/tangents/tangents.hpp"
#include "reference/frames.hpp"

using namespace paradize;

namespace {

struct Faces {
    std::vector<float> positions, normals, uvs;
    std::vector<std::uint32_t> triangles;
    mesh::Surface surface() const { return {positions, normals, uvs, triangles}; }
};

// Faces drawn by lot over few places: several at an edge, flat ones, images mirrored and without area.
Faces lot(std::uint32_t vertices, std::uint32_t faces, std::uint32_t seed) {
    const auto draw = [&](std::uint32_t below) {
        seed = seed * 1664525u + 1013904223u;
        return (seed >> 8) % below;
    };
    Faces out;
    for (std::uint32_t i = 0; i < vertices; ++i) {
        for (int k = 0; k < 3; ++k)
            out.positions.push_back(static_cast<float>(draw(4)));
        out.normals.insert(out.normals.end(), {0.6f, 0.0f, 0.8f});
        for (int k = 0; k < 2; ++k)
            out.uvs.push_back(static_cast<float>(draw(4)) / 4);
    }
    for (std::uint32_t i = 0; i < faces * 3; ++i)
        out.triangles.push_back(draw(vertices));
    return out;
}

std::vector<mesh::Frame> frames(const Faces &faces, mesh::Method method, int threads) {
    const mesh::SplitTangents split = mesh::split_tangents(faces.surface(), method, threads);
    std::vector<mesh::Frame> out;
    for (const std::uint32_t vertex : split.index)
        out.push_back(split.frames[vertex]);
    return out;
}

constexpr mesh::Method methods[] = {mesh::Method::vertex, mesh::Method::mikktspace};

} // namespace

TEST_CASE("anyFacesHaveTheSignsOfTheReference") {
    for (std::uint32_t seed = 1; seed < 60; ++seed) {
        const Faces faces = lot(3 + seed % 20, 1 + seed * 3, seed);
        std::vector<float> truth(faces.triangles.size() * 4);
        reference::corner_tangents(faces.positions, faces.normals, faces.uvs, faces.triangles, truth);
        const auto found = frames(faces, mesh::Method::mikktspace, 1);
        for (std::size_t c = 0; c < found.size(); ++c)
            CHECK(found[c].w == truth[c * 4 + 3]);
    }
}

TEST_CASE("framesAreUnitAndAtRightAnglesByEveryMethod") {
    for (const mesh::Method method : methods)
        for (const mesh::Frame &frame : frames(lot(12, 300, 7), method, 1)) {
            CHECK(std::sqrt(frame.x * frame.x + frame.y * frame.y + frame.z * frame.z) ==
                  doctest::Approx(1).epsilon(1e-6));
            CHECK(std::fabs(0.6f * frame.x + 0.8f * frame.z) < 1e-6f);
            CHECK(std::fabs(frame.w) == 1.0f);
        }
}

TEST_CASE("framesHaveTheSameBytesWithAnyThreads") {
    for (const mesh::Method method : methods) {
        const Faces faces = lot(9000, 20000, 3);
        const auto one = frames(faces, method, 1), four = frames(faces, method, 4);
        CHECK(std::memcmp(one.data(), four.data(), one.size() * sizeof(mesh::Frame)) == 0);
    }
}

TEST_CASE("cornersKeepTheVertexThatTheirsWasSplitFrom") {
    for (const mesh::Method method : methods) {
        const Faces faces = lot(10, 120, 5);
        const mesh::SplitTangents split = mesh::split_tangents(faces.surface(), method, 1);
        REQUIRE(split.index.size() == faces.triangles.size());
        for (std::size_t c = 0; c < split.index.size(); ++c)
            CHECK(split.source[split.index[c]] == faces.triangles[c]);
    }
}

TEST_CASE("noFacesHaveNoFrames") {
    const Faces faces;
    CHECK(frames(faces, mesh::Method::mikktspace, 3).empty());
    CHECK(mesh::split_tangents(faces.surface(), mesh::Method::mikktspace, 1).source.empty());
}
