#include "assets/upload_plan.hpp"
#include "files.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <map>

using namespace paradize;

TEST_CASE("upload plan: chunks cover every byte of a texture once and stay small") {
    const test::Bytes file = test::ktx2_file(assets::PixelFormat::bc3_srgb, 2048, 1024);
    const assets::Ktx2 ktx = test::read_ktx2(file, "a.ktx2");
    const assets::UploadPlan plan = plan_texture(ktx);
    std::map<std::uint32_t, std::size_t> bytes;
    std::map<std::uint32_t, std::uint32_t> rows;
    for (const assets::UploadChunk &chunk : plan.chunks) {
        CHECK(chunk.bytes.size() <= assets::chunk_bytes);
        CHECK(chunk.offset == rows[chunk.level]);
        CHECK(chunk.offset % 4 == 0); // whole blocks
        bytes[chunk.level] += chunk.bytes.size();
        rows[chunk.level] += chunk.rows;
    }
    for (std::size_t level = 0; level < ktx.levels.size(); ++level) {
        CHECK(bytes[static_cast<std::uint32_t>(level)] == ktx.levels[level].bytes.size());
    }
}

TEST_CASE("upload plan: the pieces of a texture are its coarse mips and each finer one, coarse before fine") {
    const test::Bytes image = test::ktx2_file(assets::PixelFormat::rgba8_srgb, 512, 512);
    const assets::Ktx2 ktx = test::read_ktx2(image, "a.ktx2");
    const assets::UploadPlan plan = plan_texture(ktx);
    REQUIRE(plan.pieces.size() == 4);
    CHECK(plan.pieces[0].coarse);
    CHECK(plan.pieces[0].first_level == 3); // 64 x 64
    CHECK(plan.pieces[0].levels == 7);
    for (std::uint32_t i = 1; i < 4; ++i) {
        CHECK_FALSE(plan.pieces[i].coarse);
        CHECK(plan.pieces[i].first_level == 3 - i);
        CHECK(plan.pieces[i].levels == 1);
        CHECK(plan.pieces[i].bytes == ktx.levels[3 - i].bytes.size());
    }
    std::uint32_t chunks = 0;
    for (const assets::Piece &piece : plan.pieces) {
        CHECK(piece.first_chunk == chunks);
        chunks += piece.chunks;
        for (const assets::UploadChunk &chunk : plan.chunks_of(piece)) {
            CHECK(chunk.level >= piece.first_level);
            CHECK(chunk.level < piece.first_level + piece.levels);
        }
    }
    CHECK(chunks == plan.chunks.size());
}

TEST_CASE("upload plan: a mesh has one piece per level of detail, a terrain tile one per run of patches") {
    const test::Bytes model = test::glb_file(test::glb_json());
    const assets::Glb glb = assets::read_glb(model, "a.glb");
    const assets::UploadPlan mesh = plan_mesh(glb);
    REQUIRE(mesh.pieces.size() == 2);
    CHECK(mesh.pieces[0].coarse);
    CHECK(mesh.pieces[0].first_level == 1);
    CHECK_FALSE(mesh.pieces[1].coarse);

    const std::vector<std::byte> positions(12 * 5000), indices(2 * 3 * 5000);
    assets::Glb tile;
    for (int i = 0; i < 12; ++i) { // 90 kB each: at most two in a piece
        assets::GlbLevel &patch = tile.levels.emplace_back();
        patch.vertices = 5000;
        patch.positions = positions;
        patch.primitives.push_back({0, indices, 15000});
    }
    const assets::UploadPlan patches = plan_patches(tile, 3);
    std::uint32_t next = 0;
    for (const assets::Piece &piece : patches.pieces) {
        CHECK(piece.first_level == next);
        CHECK(piece.coarse == (next < 3));
        CHECK(piece.bytes <= assets::patches_bytes);
        next += piece.levels;
    }
    CHECK(next == 12);
    CHECK(patches.pieces.size() == 7); // 2 + 1 roots, then 2 2 2 2 1
}
