// The pieces that a limit of device memory keeps, evicts and counts.
#include "assets/ktx2.hpp"
#include "context.hpp"
#include "files.hpp"
#include "small_scene.hpp"
#include "streaming/streamer.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <cstdint>
#include <string_view>
#include <tuple>
#include <vector>

using namespace paradize;
using paradize::test::SmallScene;

namespace {

// Bytes of all RGBA8 textures on the device, with those that nothing draws yet.
std::uint64_t allocated_bytes() {
    std::uint64_t bytes = 0;
    for (unsigned name = 1, end = test::names_end(); name < end; ++name) {
        if (glIsTexture(name) != GL_TRUE) {
            continue;
        }
        for (const auto &[target, image, faces] :
             {std::tuple(GL_TEXTURE_2D, GL_TEXTURE_2D, 1),
              std::tuple(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_CUBE_MAP_POSITIVE_X, 6)}) {
            glBindTexture(target, name);
            GLint bound = 0; // still the texture before, where the target is not this one's
            glGetIntegerv(target == GL_TEXTURE_2D ? GL_TEXTURE_BINDING_2D : GL_TEXTURE_BINDING_CUBE_MAP,
                          &bound);
            for (int level = 0; bound == static_cast<GLint>(name) && level < 16; ++level) {
                GLint width = 0, height = 0;
                glGetTexLevelParameteriv(image, level, GL_TEXTURE_WIDTH, &width);
                glGetTexLevelParameteriv(image, level, GL_TEXTURE_HEIGHT, &height);
                bytes += static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) * 4U *
                         static_cast<std::uint64_t>(faces);
            }
        }
    }
    glBindTexture(GL_TEXTURE_2D, 0);
    glBindTexture(GL_TEXTURE_CUBE_MAP, 0);
    test::clear_errors(); // of targets that are not a texture's own
    return bytes;
}

/// Uploads quad_color, which alone is needed, and of mip 0 a part.
void upload_half(Streamer &streamer, const UploadBudget &frame) {
    while (streamer.counts().uploads + 1 < streamer.pieces_of("quad_color").second) {
        streamer.upload(frame);
    }
    streamer.upload(frame);
    REQUIRE_FALSE(streamer.texture("quad_color")->complete());
}

} // namespace

TEST_CASE("streamer: a large piece that is half uploaded gives way to one that is needed now") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    scene.put("quad_color", test::ktx2_file(assets::PixelFormat::rgba8_srgb, 1024, 1024)); // mip 0: 4 MB
    const UploadBudget frame{.bytes = 1 << 20, .not_ready = NotReady::wait_if_seen};
    Streamer streamer = scene.streamer();
    test::Needs needs(streamer);
    needs.set("quad_color", {0.0F, 2.0F});
    upload_half(streamer, frame);
    CHECK_FALSE(streamer.texture("sky")->resident());
    needs.set("sky", {5.0F, 0.0F});
    streamer.upload(frame);
    CHECK(streamer.texture("sky")->complete());
    while (!streamer.upload(frame)) {
    }
    CHECK(streamer.texture("quad_color")->complete());
    CHECK(streamer.counts().resident_bytes == streamer.counts().total_bytes);
    test::throw_on_error();
}

TEST_CASE("streamer: a half uploaded piece that shows little gives way to one that shows much") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    scene.put("quad_color", test::ktx2_file(assets::PixelFormat::rgba8_srgb, 1024, 1024)); // mip 0: 4 MB
    scene.put("sky", test::ktx2_file(assets::PixelFormat::rgba8_unorm, 128, 128, 6));      // mip 0: 0.4 MB
    const UploadBudget frame{.bytes = 1 << 20, .not_ready = NotReady::wait_if_seen};
    Streamer streamer = scene.streamer();
    test::Needs needs(streamer);
    needs.set("quad_color", {1.5F, 0.0F});
    upload_half(streamer, frame);
    needs.set("sky", {5.0F, 0.0F});
    streamer.upload(frame);
    CHECK(streamer.texture("sky")->complete());
    CHECK_FALSE(streamer.texture("quad_color")->complete());
    while (!streamer.upload(frame)) {
    }
    CHECK(streamer.texture("quad_color")->complete());
    test::throw_on_error();
}

TEST_CASE(
    "streamer: a coarse piece that is half uploaded at the budget's end leaves the rest to what shows much") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    // its coarse piece, 6 x 64 x 64 texels of 4 bytes and their mips, is larger than the budget
    scene.put("sky", test::ktx2_file(assets::PixelFormat::rgba8_unorm, 64, 64, 6));
    Streamer streamer = scene.streamer();
    test::Needs needs(streamer);
    REQUIRE(streamer.piece(streamer.pieces_of("sky").first).coarse);
    needs.set("quad_color", {5.0F, 0.0F});
    while (streamer.counts().uploads == 0) { // its coarse piece; then the sky's comes before its finer ones
        streamer.upload({.bytes = 1, .not_ready = NotReady::wait_if_seen});
    }
    needs.set("sky", {1.5F, 0.0F});
    streamer.upload({.bytes = 60000, .urgent_bytes = 16 << 20, .not_ready = NotReady::wait_if_seen});
    CHECK_FALSE(streamer.texture("sky")->resident());
    CHECK(streamer.texture("quad_color")->complete());
    while (!streamer.upload({})) {
    }
    CHECK(streamer.complete());
    test::throw_on_error();
}

TEST_CASE("streamer: what a texture that gave way has allocated counts under the limit and in the peak") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    scene.put("quad_color", test::ktx2_file(assets::PixelFormat::rgba8_srgb, 1024, 1024)); // 5.6 MB
    scene.put("sky", test::ktx2_file(assets::PixelFormat::rgba8_unorm, 256, 256, 6));      // 2.1 MB
    constexpr std::uint64_t limit = 8400000; // one of them and the copy that the other needs
    const std::uint64_t before = allocated_bytes();
    Streamer streamer = scene.streamer({.vram_bytes = limit});
    std::uint64_t peak = 0;
    bool gave_way = false;
    const auto upload = [&] { // one chunk
        const bool done = streamer.upload({.bytes = 1});
        const std::uint64_t now = allocated_bytes() - before;
        peak = std::max(peak, now);
        CHECK(now <= limit);
        CHECK(now <= streamer.counts().peak_bytes + 1000); // and the placeholders
        return done;
    };
    test::Needs needs(streamer);
    needs.set("quad_color", {0.0F, 2.0F});
    while (allocated_bytes() - before < 6500000) { // mip 0 and the copy of the others
        REQUIRE_FALSE(upload());
    }
    REQUIRE_FALSE(streamer.texture("quad_color")->complete());
    needs.set("sky", {5.0F, 0.0F});
    while (!upload()) {
        gave_way =
            gave_way || (streamer.texture("sky")->resident() && !streamer.texture("quad_color")->complete());
    }
    CHECK(gave_way);
    CHECK(streamer.texture("sky")->complete());
    CHECK(streamer.texture("quad_color")->complete());
    CHECK(streamer.counts().peak_bytes <= limit);
    CHECK(peak > 6500000);
    test::throw_on_error();
}

TEST_CASE("streamer: a piece gives way only to one that fits beside it") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    scene.put("quad_color", test::ktx2_file(assets::PixelFormat::rgba8_srgb, 1024, 1024)); // 5.6 MB
    scene.put("sky", test::ktx2_file(assets::PixelFormat::rgba8_unorm, 256, 256, 6));      // 2.1 MB
    constexpr std::uint64_t limit = 8400000; // both, but not with the copies that both need
    const std::uint64_t before = allocated_bytes();
    Streamer streamer = scene.streamer({.vram_bytes = limit});
    test::Needs needs(streamer);
    needs.set("quad_color", {2.0F, 0.0F});
    needs.set_finest("quad_color", {});
    needs.set("sky", {2.0F, 0.0F});
    needs.set_finest("sky", {});
    REQUIRE(streamer.upload({}));
    needs.set_finest("quad_color", {0.0F, 9.0F});
    streamer.upload({.bytes = 1}); // a part of it
    REQUIRE_FALSE(streamer.texture("quad_color")->complete());
    needs.set_finest("sky", {5.0F, 0.0F});
    while (!streamer.upload({.bytes = 1})) {
        CHECK(allocated_bytes() - before <= limit);
    }
    CHECK(streamer.counts().peak_bytes <= limit);
    CHECK(streamer.texture("sky")->complete());
    CHECK(streamer.texture("quad_color")->complete());
    test::throw_on_error();
}

TEST_CASE(
    "streamer: under a limit of device memory finer pieces go and come back, and the coarse ones stay") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    for (const bool from_disk : {false, true}) {
        MemoryLimits limits{.vram_bytes = 500000};
        limits.ram_bytes = from_disk ? 0 : limits.ram_bytes;
        Streamer streamer = scene.streamer(limits);
        const StreamedTexture *color = streamer.texture("quad_color");
        REQUIRE(streamer.pieces_of("quad_color").second == 3); // 64 x 64 and coarser, 128 x 128, 256 x 256
        test::Needs needs(streamer);
        for (int round = 0; round < 3; ++round) {
            needs.set_all({2.0F, 0.0F});
            REQUIRE(streamer.upload({}));
            CHECK(color->complete());
            CHECK(test::wrong_bytes(streamer) == 0);
            CHECK(streamer.counts().worst_error == 0.0F);
            // Nothing is needed any more, but nothing else needs the memory either.
            needs.set_all({});
            streamer.upload({});
            CHECK(color->complete());
        }
        CHECK(streamer.counts().evictions == 0);
        CHECK(streamer.counts().peak_bytes <= 500000);
        test::throw_on_error();
    }
    // A limit that the finest mip exceeds: the rest is drawn, and the error is told.
    Streamer small = scene.streamer({.vram_bytes = 150000});
    test::Needs(small).set_all({3.0F, 0.0F});
    while (!small.upload({.bytes = 30000})) {
    }
    CHECK(small.texture("quad_color")->resident());
    CHECK_FALSE(small.texture("quad_color")->complete());
    CHECK(small.counts().worst_error == 3.0F);
    CHECK(small.counts().resident_bytes <= 150000);
    CHECK(small.counts().needed_bytes == small.counts().total_bytes);
    test::throw_on_error();
}

TEST_CASE(
    "streamer: what a camera needs evicts what it needs no more, and texels are right when they return") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    scene.put("sky", test::ktx2_file(assets::PixelFormat::rgba8_unorm, 128, 128, 6)); // 393 kB and coarser
    Streamer streamer = scene.streamer({.vram_bytes = 750000});
    const auto need = [&](std::string_view artifact) {
        test::Needs needs(streamer);
        needs.set(artifact, {2.0F, 0.0F});
        while (!streamer.upload({.bytes = 30000})) {
        }
        CHECK(streamer.texture(artifact)->complete());
        CHECK(streamer.counts().peak_bytes <= 750000);
    };
    for (int round = 0; round < 3; ++round) {
        need("quad_color");
        CHECK(test::wrong_bytes(streamer) == 0);
        need("sky");
        const StreamedTexture &left = *streamer.texture("quad_color");
        CHECK(left.resident());
        CHECK_FALSE(left.complete());
        left.bind(0);
        GLint finest = -1, coarsest = -1; // that are sampled, counted from the finest that is left
        glGetTexParameteriv(GL_TEXTURE_2D, GL_TEXTURE_BASE_LEVEL, &finest);
        glGetTexParameteriv(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, &coarsest);
        CHECK(finest == 0);
        CHECK(coarsest == 3 - left.finest()); // its max_level
    }
    CHECK(streamer.counts().evictions >= 5);
    test::throw_on_error();
}

TEST_CASE("streamer: a mip that goes where no copy of the others fits leaves them as they were") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    for (const auto format : {assets::PixelFormat::rgba8_srgb, assets::PixelFormat::bc1_rgb_srgb}) {
        const std::uint32_t edge = format == assets::PixelFormat::rgba8_srgb ? 512 : 1024;
        scene.put("quad_color", test::ktx2_file(format, edge, edge));
        scene.put("sky", test::ktx2_file(assets::PixelFormat::rgba8_unorm, 128, 128, 6));
        Streamer probe = scene.streamer();
        const auto [color, colors] = probe.pieces_of("quad_color");
        const std::uint64_t finest = probe.piece(color + colors - 1).bytes;
        // Room for the finest mip and the copy that its upload needs; then the sky takes half of that.
        const std::uint64_t limit = finest + finest * 2 / 3 + 1000;
        Streamer streamer = scene.streamer({.vram_bytes = limit});
        test::Needs needs(streamer);
        needs.set("quad_color", {2.0F, 0.0F});
        while (!streamer.upload({})) {
        }
        REQUIRE(streamer.texture("quad_color")->complete());
        REQUIRE(streamer.texture("sky")->resident());
        REQUIRE(streamer.counts().resident_bytes + finest / 3 > limit); // no copy fits
        needs.set("quad_color", {});
        needs.set("sky", {2.0F, 0.0F});
        while (!streamer.upload({})) {
        }
        CHECK(streamer.texture("sky")->complete());
        REQUIRE(streamer.texture("quad_color")->finest() == 1);
        CHECK(streamer.counts().peak_bytes <= limit);
        streamer.texture("quad_color")->bind(0);
        GLint size = 0;
        glGetTexLevelParameteriv(GL_TEXTURE_2D, 3, GL_TEXTURE_WIDTH, &size);
        CHECK(size == static_cast<GLint>(edge >> 4U));
        std::vector<unsigned char> texels(finest / 256);
        glPixelStorei(GL_PACK_ALIGNMENT, 1);
        if (format == assets::PixelFormat::rgba8_srgb) {
            glGetTexImage(GL_TEXTURE_2D, 3, GL_RGBA, GL_UNSIGNED_BYTE, texels.data());
        } else {
            glGetCompressedTexImage(GL_TEXTURE_2D, 3, texels.data());
        }
        for (std::size_t i = 0; i < texels.size(); ++i) {
            REQUIRE(texels[i] == (i + 4) % 256);
        }
    }
    test::throw_on_error();
}

namespace {

const Streamer *planning = nullptr;

/// A clock that each eviction moves on by a second, as if plans took long.
double planning_clock_ms() {
    return 1e3 * static_cast<double>(planning->counts().evictions);
}

} // namespace

TEST_CASE("streamer: the milliseconds of a call are those of its uploads, however long its plan takes") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    scene.put("sky", test::ktx2_file(assets::PixelFormat::rgba8_unorm, 128, 128, 6)); // 393 kB and coarser
    Streamer streamer = scene.streamer({.vram_bytes = 750000});
    planning = &streamer;
    const auto need = [&](std::string_view artifact, const UploadBudget &budget) {
        test::Needs needs(streamer);
        needs.set(artifact, {2.0F, 0.0F});
        streamer.upload(budget);
    };
    need("quad_color", {});
    REQUIRE(streamer.texture("quad_color")->complete());
    need("sky", {.ms = 2.0, .now_ms = planning_clock_ms});
    CHECK(streamer.counts().evictions > 0);
    CHECK(streamer.texture("sky")->complete()); // in one call: its uploads took no time
    test::throw_on_error();
}
