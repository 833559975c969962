// Invalid numbers are rejected with their place, in every storage type.
#include "assets/payload.hpp"
#include "assets/piece_loader.hpp"
#include "error.hpp"
#include "files.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <vector>

using namespace paradize;
using assets::PixelFormat;

namespace {

constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();

std::string error(const assets::Glb &glb) {
    try {
        assets::check_mesh(glb, "a.glb");
    } catch (const Error &error) {
        return error.what();
    }
    return "";
}

/// A valid triangle with attributes of type `Code` in rows of `stride` values.
template <typename Code>
struct Triangle {
    std::array<std::vector<Code>, assets::mesh_attributes> rows;
    std::array<std::uint16_t, 3> indices{0, 1, 2};
    std::uint32_t component;
    static constexpr std::size_t stride = 16 / sizeof(Code);

    explicit Triangle(std::uint32_t type) : component(type) {
        const Code one = std::is_floating_point_v<Code> ? Code(1) : std::numeric_limits<Code>::max();
        for (std::vector<Code> &part : rows) {
            part.resize(3 * stride);
        }
        for (std::size_t vertex = 0; vertex < 3; ++vertex) {
            at(1, vertex, 1) = one;
            at(2, vertex, 0) = one;
            at(2, vertex, 3) = one;
        }
    }

    Code &at(std::size_t part, std::size_t vertex, std::size_t channel) {
        return rows[part][vertex * stride + channel];
    }

    [[nodiscard]] assets::Glb glb() const {
        assets::Glb out;
        assets::GlbLevel &level = out.levels.emplace_back();
        level.name = "lod0";
        level.vertices = 3;
        level.low = {-1.0F, -1.0F, -1.0F};
        level.high = {1.0F, 1.0F, 1.0F};
        for (std::size_t part = 0; part < rows.size(); ++part) {
            level.formats[part] = {component, component != 5126 && part != 0, 16};
        }
        level.positions = std::as_bytes(std::span(rows[0]));
        level.normals = std::as_bytes(std::span(rows[1]));
        level.tangents = std::as_bytes(std::span(rows[2]));
        level.uvs = std::as_bytes(std::span(rows[3]));
        level.uvs1 = std::as_bytes(std::span(rows[4]));
        level.colors = std::as_bytes(std::span(rows[5]));
        level.sway = std::as_bytes(std::span(rows[6]));
        level.primitives.push_back({0, std::as_bytes(std::span(indices)), 3});
        return out;
    }
};

struct Named {
    const char *name;
    std::size_t channels;
};
constexpr std::array<Named, assets::mesh_attributes> names{{{"POSITION", 3},
                                                            {"NORMAL", 3},
                                                            {"TANGENT", 4},
                                                            {"TEXCOORD_0", 2},
                                                            {"TEXCOORD_1", 2},
                                                            {"COLOR_0", 4},
                                                            {"_SWAY", 2}}};

/// Stages every piece of a file and returns the error.
std::string loaded(const test::Bytes &file) {
    const test::Folder folder;
    assets::LoadedArtifact artifact;
    artifact.path = "a.ktx2";
    artifact.file = assets::FileBytes(folder.write("a.ktx2", file));
    artifact.ktx = test::read_ktx2(artifact.file.bytes(), artifact.path);
    artifact.plan = plan_texture(artifact.ktx);
    assets::PieceLoader loader(artifact.plan.pieces.size(),
                               [&](std::uint32_t piece, assets::StageMemory &memory) {
                                   return stage(artifact, artifact.plan.pieces[piece], memory);
                               });
    for (std::uint32_t piece = 0; piece < artifact.plan.pieces.size(); ++piece) {
        loader.order({&piece, 1});
        if (const assets::StagedPiece staged = loader.take(piece); !staged.error.empty()) {
            CHECK_FALSE(staged.file_failed);
            return staged.error;
        }
    }
    return "";
}

std::string texel_message(const test::Bytes &file) {
    try {
        assets::check_texels(test::read_ktx2(file, "a.ktx2"), "a.ktx2");
    } catch (const Error &error) {
        return error.what();
    }
    return "";
}

/// Returns the file with other bytes in level 0, which is the last one.
template <typename Code>
test::Bytes with_code(test::Bytes file, std::size_t level_codes, std::size_t at, Code code) {
    std::memcpy(file.data() + file.size() - (level_codes - at) * sizeof code, &code, sizeof code);
    return file;
}

/// A float texture of zeros.
test::Bytes zeros(PixelFormat format, std::uint32_t width, std::uint32_t height, std::uint32_t faces) {
    test::Bytes file = test::ktx2_file(format, width, height, faces);
    const assets::Ktx2 ktx = test::read_ktx2(file, "a.ktx2");
    for (const assets::Ktx2Level &level : ktx.levels) {
        std::memset(file.data() + (level.bytes.data() - file.data()), 0, level.bytes.size());
    }
    return file;
}

} // namespace

TEST_CASE("payload: a number that is not finite or too large is rejected in every attribute, vertex and "
          "channel") {
    CHECK(error(Triangle<float>(5126).glb()).empty());
    for (std::size_t part = 0; part < names.size(); ++part) {
        for (std::size_t vertex = 0; vertex < 3; ++vertex) {
            for (std::size_t channel = 0; channel < names[part].channels; ++channel) {
                for (const float value :
                     {not_a_number, -not_a_number, infinity, -infinity, 1e30F, -1e30F, 3e38F}) {
                    Triangle<float> triangle(5126);
                    triangle.at(part, vertex, channel) = value;
                    const std::string message = error(triangle.glb());
                    const std::string place = std::string("a.glb: node lod0, ") + names[part].name +
                                              ", vertex " + std::to_string(vertex) + ": is (";
                    CHECK_MESSAGE(message.starts_with(place), message);
                    CHECK(message.ends_with("paradize bake SCENE.toml"));
                }
            }
        }
    }
}

TEST_CASE("payload: bounds of positions and unit length of normals and tangents are checked to the "
          "last bit") {
    Triangle<float> triangle(5126);
    triangle.at(0, 2, 1) = 1.0F;
    CHECK(error(triangle.glb()).empty());
    triangle.at(0, 2, 1) = std::nextafter(1.0F, 2.0F);
    CHECK(error(triangle.glb()) ==
          "a.glb: node lod0, POSITION, vertex 2: is (0, 1.0000001, 0), must lie within its "
          "accessor's min (-1, -1, -1) and max (1, 1, 1); bake the scene again: paradize bake "
          "SCENE.toml");
    const auto is_rejected = [](std::size_t part, std::size_t channel, float value) {
        Triangle<float> wrong(5126);
        wrong.at(part, 1, channel) = value;
        return !error(wrong.glb()).empty();
    };
    CHECK(is_rejected(1, 1, 0.0F));
    CHECK(is_rejected(1, 1, 0.5F));
    CHECK(is_rejected(1, 1, 2.0F));
    CHECK(is_rejected(1, 1, 0.89F));
    CHECK(is_rejected(1, 1, 1.11F));
    CHECK_FALSE(is_rejected(1, 1, -1.0F));
    CHECK_FALSE(is_rejected(1, 1, 0.995F));
    CHECK(is_rejected(2, 0, 0.0F));
    CHECK(is_rejected(2, 3, 0.0F));
    CHECK(is_rejected(2, 3, -0.89F));
    CHECK_FALSE(is_rejected(2, 3, -1.0F));
    CHECK(is_rejected(5, 3, -0.001F));
    CHECK(is_rejected(5, 0, 1.001F));
    CHECK_FALSE(is_rejected(3, 0, -4000.0F));
    CHECK_FALSE(is_rejected(4, 1, 1e7F));
    CHECK(is_rejected(4, 1, std::nextafter(1e7F, infinity)));
}

TEST_CASE("payload: quantised values obey the same rules as floats") {
    Triangle<std::int8_t> bytes(5120);
    bytes.at(0, 0, 0) = 0;
    CHECK(error(bytes.glb()).empty());
    bytes.at(1, 1, 1) = 64;
    CHECK(error(bytes.glb()).find("NORMAL, vertex 1: is (0, 0.503937, 0), must have length 1") !=
          std::string::npos);
    Triangle<std::int16_t> shorts(5122);
    shorts.at(2, 2, 3) = 0;
    CHECK(error(shorts.glb()).find("TANGENT, vertex 2: is (1, 0, 0, 0), must have length 1 and w 1 or -1") !=
          std::string::npos);
    Triangle<std::uint8_t> colors(5121);
    colors.at(5, 2, 3) = 255;
    CHECK(error(colors.glb()).empty());
    bytes.at(1, 1, 1) = 127;
    bytes.at(0, 2, 0) = -128; // means -1, as does -127
    assets::Glb lowest = bytes.glb();
    lowest.levels[0].formats[0].normalized = true;
    CHECK(error(lowest).empty());
    Triangle<std::uint16_t> places(5123);
    places.at(0, 1, 2) = 1;
    CHECK(error(places.glb()).empty());
    places.at(0, 1, 2) = 2; // above the bound of 1
    CHECK(error(places.glb()).find("POSITION, vertex 1: is (0, 0, 2), must lie within") != std::string::npos);
}

TEST_CASE("payload: an index beyond the vertices is reported with place and value") {
    Triangle<float> triangle(5126);
    triangle.indices[2] = 3;
    CHECK(error(triangle.glb()) ==
          "a.glb: node lod0, primitive 0, index 2: is 3, must be below the 3 vertices; bake the "
          "scene again: paradize bake SCENE.toml");
}

TEST_CASE("payload: all four bytes of an index count, and its place is reported in indices") {
    Triangle<float> triangle(5126);
    const std::array<std::uint32_t, 3> indices{0, 65537, 2};
    assets::Glb glb = triangle.glb();
    glb.levels[0].index_bytes = 4;
    glb.levels[0].primitives[0].indices = std::as_bytes(std::span(indices));
    CHECK(error(glb).starts_with("a.glb: node lod0, primitive 0, index 1: is 65537, must be below the 3 "));
}

TEST_CASE("payload: half floats that are NaN or infinite are found in every texel, face and channel") {
    const test::Bytes file = zeros(PixelFormat::rgba16_float, 4, 4, 6);
    constexpr std::size_t codes = 4 * 4 * 6 * 4;
    CHECK(texel_message(file).empty());
    for (const std::uint16_t largest : {0x7BFF, 0xFBFF, 0x0001, 0x8000}) {
        CHECK(texel_message(with_code(file, codes, 7, largest)).empty());
    }
    for (std::size_t at = 0; at < codes; ++at) {
        for (const std::uint16_t code : {0x7C00, 0xFC00, 0x7C01, 0xFFFF}) {
            const std::string message = texel_message(with_code(file, codes, at, code));
            const std::size_t texel = at / 4;
            const std::string place = "a.ktx2: level 0, face " + std::to_string(texel / 16) + ", texel (" +
                                      std::to_string(texel % 4) + ", " + std::to_string(texel % 16 / 4) +
                                      "), channel " + std::to_string(at % 4) + ": is " +
                                      (code == 0x7C00   ? "inf,"
                                       : code == 0xFC00 ? "-inf,"
                                                        : "");
            CHECK_MESSAGE(message.starts_with(place), message);
        }
    }
}

TEST_CASE("payload: float texels must be finite and within the limit, also in compressed levels") {
    const test::Bytes file = zeros(PixelFormat::r32_float, 8, 4, 1);
    CHECK(texel_message(with_code(file, 32, 13, 1e7F)).empty());
    for (const float value : {not_a_number, infinity, 1e30F, -std::nextafter(1e7F, infinity)}) {
        const test::Bytes wrong = with_code(file, 32, 13, value);
        const std::string message = texel_message(wrong);
        CHECK_MESSAGE(message.starts_with("a.ktx2: level 0, texel (5, 1), channel 0: is "), message);
        const test::Bytes compressed = test::zstd_of(wrong);
        CHECK(texel_message(compressed).empty()); // not decompressed yet
        CHECK(loaded(compressed).starts_with("a.ktx2: level 0: texel (5, 1), channel 0: is "));
    }
    CHECK(loaded(test::zstd_of(file)).empty());
}
