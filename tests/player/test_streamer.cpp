#include "assets/scene_file.hpp"
#include "assets/stream_plan.hpp"
#include "context.hpp"
#include "error.hpp"
#include "files.hpp"
#include "scene.hpp"
#include "streamer.hpp"
#include "texture_format.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include <array>
#include <thread>
#include <vector>

using namespace paradize;

TEST_CASE("streamer: coarse first, within the budget, complete at last") {
    if (!test::have_context()) {
        return;
    }
    const test::Folder folder;
    test::write_scene(folder);
    const assets::SceneFile file = assets::parse_scene(test::SceneText().str(), "scene.json");
    Streamer streamer(file, folder.path());
    const StreamedTexture *color = streamer.texture("quad_color");
    const StreamedMesh *mesh = streamer.mesh("quad_mesh");
    REQUIRE(color != nullptr);
    REQUIRE(mesh != nullptr);
    CHECK_FALSE(color->resident());
    CHECK(mesh->best_level(0) == -1);
    CHECK(streamer.texture("") == nullptr);

    constexpr std::size_t budget = 30000;
    std::uint64_t before = 0;
    streamer.upload(budget);
    CHECK(color->resident());        // mips up to 64 x 64 came
    CHECK_FALSE(color->complete());  // 256 x 256 did not
    CHECK(mesh->best_level(0) == 0); // a small mesh fits
    CHECK(streamer.resident_bytes() <= budget);
    int frames = 1;
    while (!streamer.complete()) {
        before = streamer.resident_bytes();
        streamer.upload(budget);
        CHECK(streamer.resident_bytes() > before);
        ++frames;
        REQUIRE(frames < 100);
    }
    CHECK(color->complete());
    CHECK(mesh->best_level(0) == 0);
    CHECK(mesh->best_level(1) == 1);
    CHECK(streamer.resident_bytes() == streamer.total_bytes());
    test::demand_clean();
}

TEST_CASE("streamer: the texels that arrive are those of the file") {
    if (!test::have_context()) {
        return;
    }
    const test::Folder folder;
    test::write_scene(folder);
    const assets::SceneFile file = assets::parse_scene(test::SceneText().str(), "scene.json");
    Streamer streamer(file, folder.path());
    while (!streamer.upload(1 << 20)) {
    }
    streamer.texture("quad_color")->bind(0);
    std::vector<unsigned char> texels(256 * 256 * 4);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glGetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_UNSIGNED_BYTE, texels.data());
    int wrong = 0;
    for (std::size_t i = 0; i < texels.size(); ++i) {
        wrong += texels[i] != i % 256 ? 1 : 0;
    }
    CHECK(wrong == 0);
    test::demand_clean();
}

TEST_CASE("streamer: a supercompressed texture arrives as the plain one does, and its room is given back") {
    if (!test::have_context()) {
        return;
    }
    const test::Folder folder;
    test::write_scene(folder);
    folder.write("quad_color.ktx2", test::zstd_ktx2_file(assets::PixelFormat::rgba8_srgb, 256, 256));
    folder.write("sky.ktx2", test::zstd_ktx2_file(assets::PixelFormat::rgba8_unorm, 8, 8, 6));
    const assets::SceneFile file = assets::parse_scene(test::SceneText().str(), "scene.json");
    for (const Unready unready : {Unready::wait, Unready::leave}) {
        Streamer streamer(file, folder.path());
        int frames = 0;
        while (!streamer.upload(100000, unready)) {
            ++frames;
            std::this_thread::yield();
        }
        CHECK(frames >= 1); // 350 kB in steps of 100 kB or one piece
        CHECK(streamer.resident_bytes() == streamer.total_bytes());
        CHECK(streamer.total_bytes() > 256 * 256 * 4);
        streamer.texture("quad_color")->bind(0);
        std::vector<unsigned char> texels(256 * 256 * 4);
        glPixelStorei(GL_PACK_ALIGNMENT, 1);
        glGetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_UNSIGNED_BYTE, texels.data());
        int wrong = 0;
        for (std::size_t i = 0; i < texels.size(); ++i) {
            wrong += texels[i] != i % 256 ? 1 : 0;
        }
        CHECK(wrong == 0);
    }
    test::demand_clean();
}

TEST_CASE("streamer: a level that does not inflate is told by file and level, and stops the show") {
    if (!test::have_context()) {
        return;
    }
    const test::Folder folder;
    test::write_scene(folder);
    const test::Bytes whole = test::zstd_ktx2_file(assets::PixelFormat::rgba8_srgb, 256, 256);
    const test::Bytes short_one = test::zstd_frame(test::Bytes(256 * 256 * 4 - 1), false);
    folder.write("quad_color.ktx2", test::with_frame(whole, short_one));
    const assets::SceneFile file = assets::parse_scene(test::SceneText().str(), "scene.json");
    for (const Unready unready : {Unready::wait, Unready::leave}) {
        Streamer streamer(file, folder.path());
        std::string message;
        try {
            while (!streamer.upload(1 << 20, unready)) {
                std::this_thread::yield();
            }
        } catch (const Error &error) {
            message = error.what();
        }
        CHECK_MESSAGE(
            message.find(
                "quad_color.ktx2: level 0: its Zstandard frame holds 262143 bytes, expected 262144") !=
                std::string::npos,
            message);
    }
    { const Streamer unused(file, folder.path()); } // ends while its loader is at work
}

TEST_CASE("textures: storage of a plain 3.3 driver holds the same texels as immutable storage") {
    if (!test::have_context()) {
        return;
    }
    for (const assets::PixelFormat format :
         {assets::PixelFormat::bc5_snorm, assets::PixelFormat::rg8_snorm, assets::PixelFormat::r16_unorm,
          assets::PixelFormat::bc4_unorm, assets::PixelFormat::rg16_snorm, assets::PixelFormat::rg16_unorm,
          assets::PixelFormat::bc7_srgb}) {
        const test::Bytes bytes = test::ktx2_file(format, 16, 8);
        const assets::Ktx2 ktx = assets::read_ktx2(bytes, "a.ktx2");
        std::vector<assets::StreamPiece> pieces;
        plan_texture(ktx, 0, pieces);
        std::array<std::vector<float>, 2> texels;
        for (const Storage storage : {Storage::immutable, Storage::mutable_levels}) {
            const gl::Texture texture = allocate_texture(ktx, "a.ktx2", storage);
            for (const assets::StreamPiece &piece : pieces) {
                upload_rows(texture, ktx, piece);
            }
            std::vector<float> &out = texels[storage == Storage::immutable ? 0 : 1];
            out.resize(8 * 4 * 2);
            glGetTexImage(GL_TEXTURE_2D, 1, GL_RG, GL_FLOAT, out.data());
        }
        CHECK(texels[0] == texels[1]);
        CHECK(texels[0][0] != texels[0][2 * 5]); // there is something in it
    }
    test::demand_clean();
}

TEST_CASE("streamer: an index beyond the vertices, a wrong size and a flat sky are refused by name") {
    if (!test::have_context()) {
        return;
    }
    const test::Folder folder;
    test::write_scene(folder);
    const assets::SceneFile file = assets::parse_scene(test::SceneText().str(), "scene.json");
    folder.write("quad_mesh.glb", test::glb_file(test::glb_json(), 4));
    try {
        Streamer streamer(file, folder.path()); // ends before its files change: the loader walks their pages
        while (!streamer.upload(1 << 20)) {
        }
        FAIL("uploaded");
    } catch (const Error &error) {
        const std::string message = error.what();
        CHECK_MESSAGE(
            message.find("quad_mesh.glb: node lod0, primitive 1, index 2: is not below the 4 vertices") !=
                std::string::npos,
            message);
    }
    assets::SceneFile wrong = file;
    wrong.artifacts[0].bytes = 17; // in the order of names: quad_color
    CHECK_THROWS_AS(Streamer(wrong, folder.path()), Error);
    folder.write("sky.ktx2", test::ktx2_file(assets::PixelFormat::rgba8_unorm, 8, 8, 1));
    CHECK_THROWS_AS(Streamer(file, folder.path()), Error);
    std::filesystem::remove(folder.path() / "sky.ktx2");
    CHECK_THROWS_AS(Streamer(file, folder.path()), Error);
}

TEST_CASE("scene: visible instances come with a resident level, hidden ones do not come") {
    if (!test::have_context()) {
        return;
    }
    const test::Folder folder;
    test::write_scene(folder);
    const assets::SceneFile file = assets::parse_scene(test::SceneText().str(), "scene.json");
    Streamer streamer(file, folder.path());
    const Scene scene(file, streamer);
    CHECK(scene.instance_count() == 1);
    CHECK(scene.objects()[0].materials[1].two_sided);       // leaf, by name
    CHECK_FALSE(scene.objects()[0].materials[0].two_sided); // wood: defaults
    View view;                                              // planes of zero see all
    std::vector<DrawItem> items;
    items.reserve(scene.instance_count());
    scene.collect(view, {0.0F, 0.0F, 5.0F}, 400.0F, items);
    CHECK(items.empty());  // nothing is resident
    streamer.upload(2200); // the sky and the coarsest level of the mesh
    scene.collect(view, {0.0F, 0.0F, 5.0F}, 400.0F, items);
    REQUIRE(items.size() == 1);
    CHECK(items[0].lod == 1);
    view.planes[0] = {0.0F, 0.0F, 0.0F, -100.0F};
    items.clear();
    scene.collect(view, {0.0F, 0.0F, 5.0F}, 400.0F, items);
    CHECK(items.empty());
}

TEST_CASE("scene: a scene.json that disagrees with its meshes is refused") {
    if (!test::have_context()) {
        return;
    }
    const test::Folder folder;
    test::write_scene(folder);
    assets::SceneFile file = assets::parse_scene(test::SceneText().str(), "scene.json");
    file.objects[0].lods.pop_back();
    const Streamer streamer(file, folder.path());
    CHECK_THROWS_AS(Scene(file, streamer), Error);
}
