#include "app/playback.hpp"
#include "assets/scene/file.hpp"
#include "context.hpp"
#include "error.hpp"
#include "files.hpp"
#include "small_scene.hpp"
#include "streaming/streamer.hpp"
#include "streaming/uploads.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include <chrono>
#include <filesystem>
#include <limits>
#include <string>
#include <sys/resource.h>
#include <thread>
#include <utility>
#include <vector>

using namespace paradize;
using paradize::test::SmallScene;

namespace {

// Uploads a scene completely. Returns the error, or an empty text.
std::string upload_error(const SmallScene &scene, NotReady not_ready) {
    try {
        Streamer streamer = scene.streamer();
        while (!streamer.upload({.bytes = 1 << 20, .not_ready = not_ready})) {
            std::this_thread::yield();
        }
    } catch (const Error &error) {
        return error.what();
    }
    return "";
}

int mapped_buffers() {
    int count = 0;
    for (unsigned name = 1, end = test::names_end(); name < end; ++name) {
        if (glIsBuffer(name) == GL_TRUE) {
            GLint mapped = 0;
            glBindBuffer(GL_COPY_READ_BUFFER, name);
            glGetBufferParameteriv(GL_COPY_READ_BUFFER, GL_BUFFER_MAPPED, &mapped);
            count += mapped;
        }
    }
    return count;
}

} // namespace

TEST_CASE("streamer: coarse data first, within the budget, complete in the end") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    Streamer streamer = scene.streamer();
    const StreamedTexture *color = streamer.texture("quad_color");
    const StreamedMesh *mesh = streamer.mesh("quad_mesh");
    REQUIRE(color != nullptr);
    REQUIRE(mesh != nullptr);
    CHECK_FALSE(color->resident());
    CHECK(mesh->best_level(0) == -1);
    CHECK(streamer.texture("") == nullptr);

    constexpr std::size_t budget = 30000;
    std::uint64_t before = 0;
    streamer.upload({.bytes = budget});
    CHECK(color->resident());        // mips up to 64 x 64 are resident
    CHECK_FALSE(color->complete());  // 256 x 256 is not
    CHECK(mesh->best_level(0) == 0); // the small mesh fits
    CHECK(streamer.counts().resident_bytes <= budget);
    int frames = 1;
    while (!streamer.complete()) {
        before = streamer.counts().resident_bytes;
        streamer.upload({.bytes = budget});
        CHECK(streamer.counts().resident_bytes > before);
        ++frames;
        REQUIRE(frames < 100);
    }
    CHECK(color->complete());
    CHECK(mesh->best_level(0) == 0);
    CHECK(mesh->best_level(1) == 1);
    CHECK(streamer.counts().resident_bytes == streamer.counts().total_bytes);
    test::throw_on_error();
}

TEST_CASE("streamer: uploaded texels are those of the file") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    Streamer streamer = scene.streamer();
    while (!streamer.upload({.bytes = 1 << 20})) {
    }
    CHECK(test::wrong_bytes(streamer) == 0);
    test::throw_on_error();
}

TEST_CASE("streamer: the buffer that pieces wait in is mapped until the device has read the last of them") {
    if (!test::have_context() || !epoxy_has_gl_extension("GL_ARB_buffer_storage")) {
        return;
    }
    const SmallScene scene;
    Streamer streamer = scene.streamer();
    const UploadBudget frame{.bytes = 1}; // one chunk
    streamer.upload(frame);
    CHECK(mapped_buffers() == 0); // the first picture waits for none
    int frames = 0;
    while (!streamer.upload(frame)) {
        CHECK(mapped_buffers() == 1);
        REQUIRE(++frames < 1000);
    }
    CHECK(frames > 2);
    glFinish();
    streamer.upload(frame);
    CHECK(mapped_buffers() == 0);
    test::throw_on_error();
}

TEST_CASE("streamer: a headless frame that begins 16 MiB of files of which nothing is seen begins no other") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    scene.put("quad_color", test::ktx2_file(assets::PixelFormat::rgba8_srgb, 2048, 2048)); // 22 MB
    Streamer streamer = scene.streamer();
    test::Needs needs(streamer);
    needs.set("quad_color", {0.0F, 2.0F});
    const UploadBudget frame{.bytes = 100 << 20, .not_ready = NotReady::wait_if_seen};
    CHECK_FALSE(streamer.upload(frame));
    CHECK(streamer.texture("quad_color")->resident());
    CHECK_FALSE(streamer.texture("sky")->resident());
    CHECK(streamer.upload(frame));
    CHECK(streamer.texture("sky")->resident());
    test::throw_on_error();
}

TEST_CASE("streamer: of files that were checked it keeps a quarter of those open that a process may have") {
    rlimit before{};
    REQUIRE(::getrlimit(RLIMIT_NOFILE, &before) == 0);
    for (const auto &[may, keeps] : {std::pair(400U, 100U), std::pair(1024U, 256U), std::pair(2000U, 256U)}) {
        if (may <= before.rlim_max) {
            const rlimit limit{may, before.rlim_max};
            REQUIRE(::setrlimit(RLIMIT_NOFILE, &limit) == 0);
            CHECK(files_to_keep_open() == keeps);
        }
    }
    CHECK(::setrlimit(RLIMIT_NOFILE, &before) == 0);
}

TEST_CASE("streamer: a call that waits for all gives the texels of one mip after another") {
    if (!test::have_context()) {
        return;
    }
    const SmallScene scene;
    const auto mips = [](const Streamer &streamer) {
        const StreamedTexture &color = *streamer.texture("quad_color");
        color.bind(0);
        GLint finest = -1;
        GLint coarsest = -1;
        glGetTexParameteriv(GL_TEXTURE_2D, GL_TEXTURE_BASE_LEVEL, &finest);
        glGetTexParameteriv(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, &coarsest);
        CHECK(finest == 0);
        CHECK(coarsest == color.levels() - 1);
        std::vector<std::vector<unsigned char>> out;
        for (GLint level = 0; level < color.levels(); ++level) {
            const std::size_t edge = std::size_t{256} >> static_cast<unsigned>(level);
            out.emplace_back(edge * edge * 4);
            glGetTexImage(GL_TEXTURE_2D, level, GL_RGBA, GL_UNSIGNED_BYTE, out.back().data());
        }
        return out;
    };
    Streamer stepped = scene.streamer();
    while (!stepped.upload({.bytes = 30000})) {
    }
    Streamer whole = scene.streamer();
    CHECK(whole.upload({}));
    Streamer begun = scene.streamer(); // its coarse mips are there already
    begun.upload({.bytes = 30000});
    CHECK(begun.texture("quad_color")->resident());
    CHECK(begun.upload({}));
    CHECK(mips(whole) == mips(stepped));
    CHECK(mips(begun) == mips(stepped));
    test::throw_on_error();
}

TEST_CASE("streamer: a compressed texture gives the same texels, and its memory is freed") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    scene.put("quad_color", test::zstd_ktx2_file(assets::PixelFormat::rgba8_srgb, 256, 256));
    scene.put("sky", test::zstd_ktx2_file(assets::PixelFormat::rgba8_unorm, 8, 8, 6));
    for (const NotReady not_ready : {NotReady::wait, NotReady::skip}) {
        Streamer streamer = scene.streamer();
        int frames = 0;
        while (!streamer.upload({.bytes = 100000, .not_ready = not_ready})) {
            ++frames;
            std::this_thread::yield();
        }
        CHECK(frames >= 1); // 350 kB in steps of 100 kB or one chunk
        CHECK(streamer.counts().resident_bytes == streamer.counts().total_bytes);
        CHECK(streamer.counts().total_bytes > 256 * 256 * 4);
        CHECK(test::wrong_bytes(streamer) == 0);
    }
    test::throw_on_error();
}

TEST_CASE("streamer: what nothing refers to is checked and never loaded") {
    if (!test::have_context()) {
        return;
    }
    test::SceneText text;
    text.color = "null";
    SmallScene scene;
    scene.file = assets::parse_scene(text.str(), "scene.json");
    Streamer streamer = scene.streamer();
    while (!streamer.upload({})) {
    }
    CHECK(streamer.complete());
    CHECK_FALSE(streamer.texture("quad_color")->resident());
    CHECK(streamer.counts().total_bytes < 256 * 256 * 4);
    std::filesystem::resize_file(scene.folder.path() / "quad_color.ktx2", 100);
    CHECK_THROWS_AS(scene.streamer(), Error);
}

TEST_CASE("streamer: threads check what is needed now before the first upload, and nothing else") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    scene.damage_color();
    const auto is_found_out = [&](float need) {
        Streamer streamer = scene.streamer();
        test::Needs needs(streamer);
        needs.set("quad_color", {need, 0.0F});
        streamer.begin_reading();
        try {
            for (int i = 0; i < (need > 1.0F ? 10000 : 50); ++i) {
                streamer.checked();
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
            }
        } catch (const Error &error) {
            return std::string(error.what()).find("quad_color.ktx2: is damaged") != std::string::npos;
        }
        return false;
    };
    CHECK(is_found_out(2.0F));
    CHECK_FALSE(is_found_out(0.0F));
}

TEST_CASE("streamer: a level that does not decompress is reported by file and level and ends playback") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    const test::Bytes whole = test::zstd_ktx2_file(assets::PixelFormat::rgba8_srgb, 256, 256);
    const test::Bytes short_one = test::zstd_frame(test::Bytes(256 * 256 * 4 - 1), false);
    scene.put("quad_color", test::with_frame(whole, short_one));
    for (const NotReady not_ready : {NotReady::wait, NotReady::skip}) {
        const std::string message = upload_error(scene, not_ready);
        CHECK_MESSAGE(
            message.find(
                "quad_color.ktx2: level 0: its Zstandard frame holds 262143 bytes, expected 262144") !=
                std::string::npos,
            message);
    }
    { const Streamer unused = scene.streamer(); } // destroyed while its loader is running
}

TEST_CASE("streamer: an index beyond the vertices, a wrong size and a flat sky are rejected by name") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    scene.put("quad_mesh", test::glb_file(test::glb_json(), 4));
    const std::string message = upload_error(scene, NotReady::wait);
    CHECK_MESSAGE(
        message.find("quad_mesh.glb: node lod0, primitive 1, index 2: is 4, must be below the 4 vertices") !=
            std::string::npos,
        message);
    assets::SceneFile wrong = scene.file;
    wrong.artifacts[0].bytes = 17; // quad_color is the first in order of names
    CHECK_THROWS_AS(Streamer(wrong, scene.folder.path()), Error);
    scene.put("sky", test::ktx2_file(assets::PixelFormat::rgba8_unorm, 8, 8, 1));
    CHECK_THROWS_AS(scene.streamer(), Error);
    std::filesystem::remove(scene.folder.path() / "sky.ktx2");
    CHECK_THROWS_AS(scene.streamer(), Error);
}

TEST_CASE("streamer: what shows little does not end a budget that is left for what shows much") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    scene.put("quad_color", test::ktx2_file(assets::PixelFormat::rgba8_srgb, 1024, 1024)); // 5.6 MB
    Streamer streamer = scene.streamer();
    test::Needs needs(streamer);
    needs.set_all({1.5F, 0.0F});
    needs.set("quad_color", {5.0F, 0.0F});
    // The coarse pieces of the others, which come before its finer mips, have no room any more.
    streamer.upload({.bytes = 1, .urgent_bytes = 16 << 20, .not_ready = NotReady::wait_if_seen});
    CHECK(streamer.texture("quad_color")->complete());
    CHECK_FALSE(streamer.complete());
    test::throw_on_error();
}

TEST_CASE("streamer: a budget for what shows much holds for it alone") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    scene.put("quad_color", test::ktx2_file(assets::PixelFormat::rgba8_srgb, 1024, 1024)); // 5.6 MB
    const UploadBudget first{.bytes = 1 << 20, .urgent_bytes = 16 << 20, .not_ready = NotReady::wait_if_seen};
    for (const float error : {1.5F, 5.0F}) {
        Streamer streamer = scene.streamer();
        test::Needs needs(streamer);
        needs.set("quad_color", {error, 0.0F});
        streamer.upload(first);
        CHECK(streamer.texture("quad_color")->complete() == (error > 2.0F));
        CHECK((streamer.counts().uploaded_bytes <= first.bytes) == (error < 2.0F));
    }
    test::throw_on_error();
}

TEST_CASE("streamer: a piece that the budget for what shows much cannot end leaves it to those that it can") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    scene.put("quad_color", test::ktx2_file(assets::PixelFormat::rgba8_srgb, 1024, 1024)); // 5.6 MB
    scene.put("sky", test::ktx2_file(assets::PixelFormat::rgba8_unorm, 256, 256, 6));      // 2.1 MB
    Streamer streamer = scene.streamer();
    test::Needs needs(streamer);
    needs.set("quad_color", {9.0F, 0.0F});
    needs.set("sky", {5.0F, 0.0F});
    constexpr std::size_t urgent = 4 << 20; // less than the finest mip and all that is coarser
    streamer.upload({.bytes = 1, .urgent_bytes = urgent, .not_ready = NotReady::wait_if_seen});
    CHECK(streamer.texture("sky")->complete());
    CHECK_FALSE(streamer.texture("quad_color")->complete());
    CHECK(streamer.counts().uploaded_bytes > urgent - 2 * assets::chunk_bytes); // and what is left to it
    CHECK(streamer.counts().uploaded_bytes <= urgent);
    while (!streamer.upload({.bytes = 1, .not_ready = NotReady::wait_if_seen})) {
    }
    CHECK(streamer.complete());
    test::throw_on_error();
}

namespace {

int clock_looks = 0;

/// A clock that goes on by 20 ms whenever somebody looks at it.
double slow_clock_ms() {
    return 20.0 * clock_looks++;
}

} // namespace

TEST_CASE("streamer: a frame in a window uploads 50 ms at first and 2 ms later, and at most 16 and 4 MiB") {
    constexpr std::size_t mebibyte = 1 << 20;
    const UploadBudget first = frame_budget(true, false, UploadOrder::needs);
    const UploadBudget later = frame_budget(false, false, UploadOrder::needs);
    CHECK((first.ms == 50.0 && later.ms == 2.0));
    CHECK((first.bytes == 4 * mebibyte && first.urgent_bytes == 16 * mebibyte));
    CHECK((later.bytes == 4 * mebibyte && later.urgent_bytes == 0));
    CHECK((first.not_ready == NotReady::skip && later.not_ready == NotReady::skip));
    for (const bool at_first : {false, true}) {
        const UploadBudget headless = frame_budget(at_first, true, UploadOrder::needs);
        CHECK(headless.ms == std::numeric_limits<double>::infinity());
        CHECK(headless.not_ready == NotReady::wait_if_seen);
        CHECK(frame_budget(at_first, true, UploadOrder::file).not_ready == NotReady::wait);
        CHECK(frame_budget(at_first, false, UploadOrder::file).urgent_bytes == 0);
    }
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    scene.put("quad_color", test::ktx2_file(assets::PixelFormat::rgba8_srgb, 1024, 1024)); // 5.6 MB
    Streamer streamer = scene.streamer();
    test::Needs(streamer).set_all({5.0F, 0.0F});
    streamer.finish_checks();
    const auto chunks = [&](UploadBudget budget) {
        clock_looks = 0;
        budget.now_ms = slow_clock_ms;
        streamer.upload(budget);
        return clock_looks - 2; // one look at the start, one that finds the time over
    };
    CHECK(chunks(first) == 2); // at 20 and 40 ms
    CHECK(chunks(later) == 1); // at least one, so that streaming goes on
    CHECK_FALSE(streamer.complete());
    test::throw_on_error();
}

TEST_CASE("streamer: a call whose time is over uploads one chunk") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    scene.put("quad_color", test::ktx2_file(assets::PixelFormat::rgba8_srgb, 1024, 1024)); // 5.6 MB
    Streamer streamer = scene.streamer();
    std::uint64_t before = 0;
    while (!streamer.upload({.urgent_bytes = 16 << 20, .ms = 0.0})) {
        CHECK(streamer.counts().uploaded_bytes > before);
        CHECK(streamer.counts().uploaded_bytes <= before + assets::chunk_bytes);
        before = streamer.counts().uploaded_bytes;
    }
    CHECK(streamer.complete());
    test::throw_on_error();
}
