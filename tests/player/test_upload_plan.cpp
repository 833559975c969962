#include "assets/upload_plan.hpp"
#include "files.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <map>

using namespace paradize;

TEST_CASE("upload plan: chunks cover every byte of a texture once and stay small") {
    const test::Bytes file = test::ktx2_file(assets::PixelFormat::bc3_srgb, 2048, 1024);
    const assets::Ktx2 ktx = assets::read_ktx2(file, "a.ktx2");
    std::vector<assets::UploadChunk> chunks;
    plan_texture(ktx, 0, chunks);
    std::map<std::uint32_t, std::size_t> bytes;
    std::map<std::uint32_t, std::uint32_t> rows;
    for (const assets::UploadChunk &chunk : chunks) {
        CHECK(chunk.bytes.size() <= assets::chunk_bytes);
        CHECK(chunk.offset == rows[chunk.level]);
        CHECK(chunk.offset % 4 == 0); // whole blocks
        bytes[chunk.level] += chunk.bytes.size();
        rows[chunk.level] += chunk.rows;
        CHECK(chunk.last == (rows[chunk.level] == ktx.levels[chunk.level].height_px));
    }
    for (std::size_t level = 0; level < ktx.levels.size(); ++level) {
        CHECK(bytes[static_cast<std::uint32_t>(level)] == ktx.levels[level].bytes.size());
    }
}

TEST_CASE("upload plan: coarse data of all artifacts comes first, finer after coarser") {
    const test::Bytes image = test::ktx2_file(assets::PixelFormat::rgba8_srgb, 512, 512);
    const test::Bytes model = test::glb_file(test::glb_json());
    const assets::Ktx2 ktx = assets::read_ktx2(image, "a.ktx2");
    const assets::Glb glb = assets::read_glb(model, "a.glb");
    std::vector<assets::UploadChunk> chunks;
    plan_texture(ktx, 0, chunks);
    plan_mesh(glb, 1, chunks);
    order_chunks(chunks);
    const auto first_fine = std::find_if(chunks.begin(), chunks.end(),
                                         [](const assets::UploadChunk &chunk) { return !chunk.coarse; });
    std::map<std::uint32_t, std::uint32_t> last_level;
    bool seen[2] = {false, false};
    for (auto chunk = chunks.begin(); chunk != chunks.end(); ++chunk) {
        CHECK(chunk->coarse == (chunk < first_fine));
        if (chunk->coarse) {
            seen[chunk->artifact] = true;
        }
        if (last_level.contains(chunk->artifact)) {
            CHECK(chunk->level <= last_level[chunk->artifact]);
        }
        last_level[chunk->artifact] = chunk->level;
    }
    CHECK(seen[0]);
    CHECK(seen[1]);
    CHECK(std::count_if(chunks.begin(), chunks.end(),
                        [](const assets::UploadChunk &p) { return p.artifact == 1 && p.last; }) == 2);
}
