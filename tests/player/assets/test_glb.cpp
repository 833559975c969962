#include "assets/glb.hpp"
#include "error.hpp"
#include "files.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cstring>

using namespace paradize;

namespace {

void check_refused(const std::string &json, const std::string &part) {
    try {
        assets::read_glb(test::glb_file(json), "a.glb");
        FAIL("accepted: " << part);
    } catch (const Error &error) {
        CHECK_MESSAGE(std::string(error.what()).find(part) != std::string::npos, std::string(error.what()));
    }
}

} // namespace

TEST_CASE("GLB: levels, primitives and materials are read as written") {
    const test::Bytes file = test::glb_file(test::glb_json());
    const assets::Glb glb = assets::read_glb(file, "a.glb");
    REQUIRE(glb.levels.size() == 2);
    CHECK(glb.materials == std::vector<std::string>{"wood", "leaf"});
    CHECK(glb.levels[0].name == "lod0");
    CHECK(glb.levels[0].vertices == 4);
    CHECK(glb.levels[0].normals.size() == 48);
    CHECK(glb.levels[0].tangents.empty());
    REQUIRE(glb.levels[0].primitives.size() == 2);
    CHECK(glb.levels[0].primitives[1].material == 1);
    CHECK(glb.levels[0].primitives[1].count == 3);
    CHECK(glb.levels[1].vertices == 3);
}

TEST_CASE("GLB: without MSFT_lod there is one level") {
    CHECK(assets::read_glb(test::glb_file(test::glb_json(false)), "a.glb").levels.size() == 1);
}

TEST_CASE("GLB: a file truncated anywhere is rejected") {
    const test::Bytes file = test::glb_file(test::glb_json());
    for (std::size_t length = 0; length < file.size(); ++length) {
        const test::Bytes cut(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(length));
        CHECK_THROWS_AS(assets::read_glb(cut, "cut.glb"), Error);
    }
}

TEST_CASE("GLB: a truncated file with a matching length in its header is rejected or harmless") {
    const test::Bytes file = test::glb_file(test::glb_json());
    for (std::size_t length = 20; length < file.size(); ++length) {
        test::Bytes cut(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(length));
        const auto claimed = static_cast<std::uint32_t>(length);
        std::memcpy(cut.data() + 8, &claimed, sizeof claimed);
        CHECK_THROWS_AS(assets::read_glb(cut, "cut.glb"), Error);
    }
}

TEST_CASE("GLB: any wrong byte is harmless") {
    const test::Bytes file = test::glb_file(test::glb_json());
    for (std::size_t at = 0; at < file.size(); ++at) {
        for (const unsigned value : {0x00U, 0x39U, 0x5DU, 0xFFU}) {
            test::Bytes wrong = file;
            wrong[at] = static_cast<std::byte>(value);
            try {
                const assets::Glb glb = assets::read_glb(wrong, "wrong.glb");
                for (const assets::GlbLevel &level : glb.levels) {
                    CHECK(level.positions.data() + level.positions.size() <= wrong.data() + wrong.size());
                }
            } catch (const Error &) { // rejected, which is fine
            }
        }
    }
}

TEST_CASE("GLB: content that the player cannot draw is rejected with its place") {
    const std::string json = test::glb_json();
    check_refused(test::replaced(json, "\"byteLength\":108", "\"byteLength\":109"),
                  "buffers[0].byteLength: is 109");
    check_refused(
        test::replaced(json, "\"byteOffset\":96,\"byteLength\":12", "\"byteOffset\":96,\"byteLength\":13"),
        "bufferViews[2].byteLength");
    check_refused(test::replaced(json, "\"count\":4,\"type\":\"VEC3\"", "\"count\":5,\"type\":\"VEC3\""),
                  "accessors[0].count");
    check_refused(test::replaced(json, "\"indices\":2", "\"indices\":9"),
                  "indices: is 9, must lie in [0, 4]");
    check_refused(test::replaced(json, "\"ids\":[1]", "\"ids\":[7]"), "ids[0]: is 7");
    check_refused(
        test::replaced(json, "\"bufferView\":2,\"byteOffset\":6", "\"bufferView\":2,\"byteOffset\":5"),
        "accessors[3].byteOffset");
    check_refused(test::replaced(json, "\"version\":\"2.0\"", "\"version\":\"3.0\""), "version must be 2.0");
    check_refused(test::replaced(json, "\"scene\":0", "\"scene\":0,\"scene\":0"), "appears twice");
}

TEST_CASE("GLB: a small file with shared indices does not become a large mesh") {
    const std::string one = R"({"attributes":{"POSITION":0,"NORMAL":1},"indices":2,"material":0},)";
    std::string many;
    for (int i = 0; i < 90; ++i) {
        many += one;
    }
    check_refused(test::replaced(test::glb_json(), one, many), "the limit is 4 times as many");
}

TEST_CASE("GLB: data outside the buffer is reported with its correct offset") {
    const std::string json = test::glb_json();
    const auto with = [&](const std::string &from, const std::string &to) {
        return test::replaced(json, from, to);
    };
    check_refused(with(R"("byteOffset":96,"byteLength":12)", R"("byteOffset":97,"byteLength":12)"),
                  "bufferViews[2].byteLength: 12 bytes from byte 97 on exceed a buffer of 108");
    check_refused(with(R"("byteOffset":6,"componentType":5123)", R"("byteOffset":8,"componentType":5123)"),
                  "accessors[3].count: 3 entries of 2 bytes from byte 8 on exceed a view of 12");
    check_refused(with(R"("byteOffset":6,"componentType":5123,"count":3)",
                       R"("byteOffset":1,"componentType":5123,"count":3)"),
                  "accessors[3].byteOffset: byte 97 of the buffer, must be a multiple of 2");
    check_refused(
        with(R"("byteOffset":0,"byteLength":48)", R"("byteOffset":0,"byteStride":16,"byteLength":48)"),
        "bufferViews[0].byteStride: is 16, must be 12");
    std::string none = with(R"("nodes":[{"name":"lod0","mesh":0,"extensions":{"MSFT_lod":{"ids":[1]}}},)"
                            R"({"name":"lod1","mesh":1}])",
                            R"("nodes":[])");
    check_refused(none, "scenes[0].nodes[0]: is 0, but the file has no such entries");
    test::Bytes file = test::glb_file(json);
    file[12] = std::byte{0xFF}; // length of the first chunk, shorter than its text
    CHECK_THROWS_AS(assets::read_glb(file, "a.glb"), Error);
}

namespace {

/// One quantised triangle: positions in bytes 0 to 24, normals 24 to 36, UVs 36 to 48, indices 48 to 54.
std::string quantised_json() {
    return R"({"asset":{"version":"2.0"},"extensionsRequired":["KHR_mesh_quantization"],"scene":0,
"scenes":[{"nodes":[0]}],"nodes":[{"name":"lod0","mesh":0,"translation":[1,2,3],"scale":[0.5,0.25,0.125]}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2},"indices":3}]}],
"materials":[{"name":"wood","extras":{"center":[1,2,3],"uv_per_m":0.25}}],
"accessors":[{"bufferView":0,"componentType":5123,"count":3,"type":"VEC3","min":[0,0,0],"max":[65535,65535,65535]},
{"bufferView":1,"componentType":5120,"normalized":true,"count":3,"type":"VEC3"},
{"bufferView":2,"componentType":5123,"normalized":true,"count":3,"type":"VEC2"},
{"bufferView":3,"componentType":5123,"count":3,"type":"SCALAR"}],
"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":24,"byteStride":8},
{"buffer":0,"byteOffset":24,"byteLength":12,"byteStride":4},
{"buffer":0,"byteOffset":36,"byteLength":12},{"buffer":0,"byteOffset":48,"byteLength":6}],
"buffers":[{"byteLength":54}]})";
}

} // namespace

TEST_CASE("GLB: quantised attributes are read with types, strides and grid") {
    const test::Bytes file = test::glb_file(quantised_json());
    const assets::Glb glb = assets::read_glb(file, "a.glb");
    REQUIRE(glb.levels.size() == 1);
    const assets::GlbLevel &level = glb.levels[0];
    CHECK(level.vertices == 3);
    CHECK(level.positions.size() == 24);
    CHECK(level.formats[0] == assets::GlbFormat{5123, false, 8});
    CHECK(level.formats[1] == assets::GlbFormat{5120, true, 4});
    CHECK(level.formats[3] == assets::GlbFormat{5123, true, 4});
    CHECK(glb.grid.step == std::array<float, 3>{0.5F, 0.25F, 0.125F});
    CHECK(glb.grid.origin == std::array<double, 3>{1.0, 2.0, 3.0});
    CHECK(assets::read_glb(test::glb_file(test::glb_json()), "b.glb").grid == assets::QuantisationGrid());
}

TEST_CASE(
    "GLB: what the bake measured of the coarsest level's materials is read, and nothing else accepted") {
    const assets::Glb two = assets::read_glb(test::glb_file(test::glb_json()), "a.glb");
    REQUIRE(two.measures.size() == 2);
    CHECK(two.measures[0].uv_per_m == 0.0F);
    CHECK(two.measures[1].center == glm::vec3(0.0F)); // level 1 does not draw it
    CHECK(assets::read_glb(test::glb_file(test::glb_json(false)), "a.glb").measures[1].center ==
          glm::vec3(0.5F, 0.0F, -0.5F));
    const std::string json = quantised_json();
    const assets::Glb one = assets::read_glb(test::glb_file(json), "a.glb");
    CHECK(one.measures[0].center == glm::vec3(1.0F, 2.0F, 3.0F));
    CHECK(one.measures[0].uv_per_m == 0.25F);
    CHECK(one.measures[0].uv1_per_m == 0.0F);
    const std::string second = test::replaced(json, R"("TEXCOORD_0":2)", R"("TEXCOORD_0":2,"TEXCOORD_1":2)");
    const std::string both = test::replaced(second, R"("uv_per_m":0.25)", R"("uv_per_m":2,"uv1_per_m":4)");
    CHECK(assets::read_glb(test::glb_file(both), "a.glb").measures[0].uv1_per_m == 4.0F);
    check_refused(second, "materials[0].extras.uv1_per_m: is missing");
    for (const auto &[from, to, part] : std::vector<std::array<std::string, 3>>{
             {R"(,"extras":{"center":[1,2,3],"uv_per_m":0.25})", "", "materials[0].extras: is missing"},
             {R"("center":[1,2,3],)", "", "materials[0].extras.center: is missing"},
             {"\"center\":[1,2,3]", "\"center\":[1,2]",
              "materials[0].extras.center: must be an array of 3 entries"},
             {"\"center\":[1,2,3]", "\"center\":[1,2,1e8]", "materials[0].extras.center[2]: is 100000000"},
             {R"(,"uv_per_m":0.25)", "", "materials[0].extras.uv_per_m: is missing"},
             {R"("uv_per_m":0.25)", R"("uv_per_m":-1)", "materials[0].extras.uv_per_m: is -1"},
             {R"("uv_per_m":0.25)", R"("uv_per_m":1e31)", "materials[0].extras.uv_per_m: is 1e+31"},
             {R"("uv_per_m":0.25)", R"("uv_per_m":null)", "materials[0].extras.uv_per_m: must be a number"},
             {R"([{"name":"wood","extras":{"center":[1,2,3],"uv_per_m":0.25}}])", "[]",
              "materials: are missing"}}) {
        check_refused(test::replaced(json, from, to), part);
    }
}

TEST_CASE("GLB: unsupported quantised attributes are rejected with their place") {
    const std::string json = quantised_json();
    check_refused(
        test::replaced(json, R"("componentType":5120,"normalized":true)", R"("componentType":5120)"),
        "NORMAL: must be normalized");
    check_refused(test::replaced(json, R"("componentType":5123,"count":3,"type":"VEC3")",
                                 R"("componentType":5123,"normalized":true,"count":3,"type":"VEC3")"),
                  "POSITION: must not be normalized");
    check_refused(test::replaced(json, R"("componentType":5120)", R"("componentType":5121)"),
                  "NORMAL: has the component type 5121");
    check_refused(test::replaced(json, R"("componentType":5120)", R"("componentType":5124)"),
                  "accessors[1].componentType");
    check_refused(test::replaced(json, R"("byteLength":24,"byteStride":8)", R"("byteLength":24)"),
                  "bufferViews[0].byteStride: is 6, must be 8");
    check_refused(
        test::replaced(json, R"("byteLength":24,"byteStride":8)", R"("byteLength":24,"byteStride":12)"),
        "bufferViews[0].byteStride: is 12, must be 8");
    check_refused(test::replaced(json, R"("byteLength":24,"byteStride")", R"("byteLength":23,"byteStride")"),
                  "accessors[0].count");
    check_refused(test::replaced(json, "[0.5,0.25,0.125]", "[0.5,0,0.125]"), "scale");
    check_refused(test::replaced(json, "[0.5,0.25,0.125]", "[0.5,0.25]"), "scale");
    check_refused(test::replaced(json, R"("mesh":0,)", R"("mesh":0,"rotation":[0,0,0,1],)"), "rotation");
}

TEST_CASE("GLB: levels with different grids are rejected") {
    check_refused(test::replaced(test::glb_json(), R"("name":"lod1",)", R"("name":"lod1","scale":[2,2,2],)"),
                  "must be those of the other levels");
}
