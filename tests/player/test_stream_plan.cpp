#include "assets/stream_plan.hpp"
#include "files.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <map>

using namespace paradize;

TEST_CASE("streaming: pieces cover every byte of a texture once and stay small") {
    const test::Bytes file = test::ktx2_file(assets::PixelFormat::bc3_srgb, 2048, 1024);
    const assets::Ktx2 ktx = assets::read_ktx2(file, "a.ktx2");
    std::vector<assets::StreamPiece> pieces;
    plan_texture(ktx, 0, pieces);
    std::map<std::uint32_t, std::size_t> bytes;
    std::map<std::uint32_t, std::uint32_t> rows;
    for (const assets::StreamPiece &piece : pieces) {
        CHECK(piece.bytes.size() <= assets::piece_bytes);
        CHECK(piece.offset == rows[piece.level]);
        CHECK(piece.offset % 4 == 0); // whole blocks
        bytes[piece.level] += piece.bytes.size();
        rows[piece.level] += piece.rows;
        CHECK(piece.last == (rows[piece.level] == ktx.levels[piece.level].height_px));
    }
    for (std::size_t level = 0; level < ktx.levels.size(); ++level) {
        CHECK(bytes[static_cast<std::uint32_t>(level)] == ktx.levels[level].bytes.size());
    }
}

TEST_CASE("streaming: something coarse of everything comes before anything fine, finer after coarser") {
    const test::Bytes image = test::ktx2_file(assets::PixelFormat::rgba8_srgb, 512, 512);
    const test::Bytes model = test::glb_file(test::glb_json());
    const assets::Ktx2 ktx = assets::read_ktx2(image, "a.ktx2");
    const assets::Glb glb = assets::read_glb(model, "a.glb");
    std::vector<assets::StreamPiece> pieces;
    plan_texture(ktx, 0, pieces);
    plan_mesh(glb, 1, pieces);
    order_pieces(pieces);
    const auto first_fine = std::find_if(pieces.begin(), pieces.end(),
                                         [](const assets::StreamPiece &piece) { return !piece.coarse; });
    std::map<std::uint32_t, std::uint32_t> last_level;
    bool seen[2] = {false, false};
    for (auto piece = pieces.begin(); piece != pieces.end(); ++piece) {
        CHECK(piece->coarse == (piece < first_fine));
        if (piece->coarse) {
            seen[piece->artifact] = true;
        }
        if (last_level.contains(piece->artifact)) {
            CHECK(piece->level <= last_level[piece->artifact]);
        }
        last_level[piece->artifact] = piece->level;
    }
    CHECK(seen[0]);
    CHECK(seen[1]);
    CHECK(std::count_if(pieces.begin(), pieces.end(),
                        [](const assets::StreamPiece &p) { return p.artifact == 1 && p.last; }) == 2);
}
