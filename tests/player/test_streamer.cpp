#include "assets/scene_file.hpp"
#include "assets/sha256.hpp"
#include "assets/upload_plan.hpp"
#include "context.hpp"
#include "error.hpp"
#include "files.hpp"
#include "streaming/scene.hpp"
#include "streaming/streamer.hpp"
#include "streaming/texture_format.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

using namespace paradize;

namespace {

// The small scene of files.hpp in its own folder.
struct SmallScene {
    test::Folder folder;
    assets::SceneFile file = assets::parse_scene(test::SceneText().str(), "scene.json");

    SmallScene() { test::write_scene(folder); }
    [[nodiscard]] Streamer streamer() const { return Streamer(file, folder.path()); }
    // Replaces the file of an artifact, as a bake does.
    void put(const std::string &name, const test::Bytes &bytes) {
        const auto entry = std::ranges::find(file.artifacts, name, &assets::Artifact::name);
        folder.write(entry->file, bytes);
        entry->sha256 = assets::sha256_of(bytes);
        entry->bytes = bytes.size();
    }
};

// Number of bytes of quad_color on the device that differ from its file.
int wrong_bytes(const Streamer &streamer) {
    streamer.texture("quad_color")->bind(0);
    std::vector<unsigned char> texels(256 * 256 * 4);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glGetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_UNSIGNED_BYTE, texels.data());
    int wrong = 0;
    for (std::size_t i = 0; i < texels.size(); ++i) {
        wrong += texels[i] != i % 256 ? 1 : 0;
    }
    return wrong;
}

// Bytes of all RGBA8 textures on the device, with those that nothing draws yet.
std::uint64_t allocated_bytes() {
    std::uint64_t bytes = 0;
    for (unsigned name = 1; name < 4096; ++name) {
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
    CHECK(wrong_bytes(streamer) == 0);
    test::throw_on_error();
}

TEST_CASE("streamer: files that shrink, grow or vanish during streaming are drawn as they were") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    for (const bool compressed : {false, true}) {
        if (compressed) {
            scene.put("quad_color", test::zstd_ktx2_file(assets::PixelFormat::rgba8_srgb, 256, 256));
        }
        Streamer streamer = scene.streamer();
        CHECK_FALSE(streamer.upload({.bytes = 30000})); // in the middle of streaming
        streamer.finish_checks();
        for (const assets::Artifact &artifact : scene.file.artifacts) {
            std::filesystem::resize_file(scene.folder.path() / artifact.file,
                                         artifact.name == "sky" ? 1 << 20 : 0);
        }
        std::filesystem::remove(scene.folder.path() / "quad_mesh.glb");
        while (!streamer.upload({.bytes = 30000})) {
        }
        CHECK(wrong_bytes(streamer) == 0);
        test::write_scene(scene.folder);
    }
    test::throw_on_error();
}

TEST_CASE(
    "streamer: a scene above the memory limit gives the same texels, even if a bake deletes its files") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    for (const bool compressed : {false, true}) {
        if (compressed) {
            scene.put("quad_color", test::zstd_ktx2_file(assets::PixelFormat::rgba8_srgb, 256, 256));
        }
        Streamer streamer(scene.file, SceneLoad(scene.file, scene.folder.path(), nullptr, {.ram_bytes = 0}));
        streamer.finish_checks();
        for (const assets::Artifact &artifact : scene.file.artifacts) {
            std::filesystem::remove(scene.folder.path() / artifact.file);
        }
        while (!streamer.upload({.bytes = 30000})) {
        }
        CHECK(wrong_bytes(streamer) == 0);
        CHECK(streamer.counts().resident_bytes == streamer.counts().total_bytes);
        test::write_scene(scene.folder);
    }
    test::throw_on_error();
}

TEST_CASE(
    "streamer: a file that is changed or shrinks after it was checked ends that artifact, not the scene") {
    if (!test::have_context()) {
        return;
    }
    const SmallScene scene;
    const std::filesystem::path color = scene.folder.path() / "quad_color.ktx2";
    for (const bool shrinks : {false, true}) {
        Streamer streamer(scene.file, SceneLoad(scene.file, scene.folder.path(), nullptr, {.ram_bytes = 0}));
        streamer.upload({.bytes = 30000}); // the coarse mips
        streamer.finish_checks();
        CHECK(streamer.failures().empty());
        // The loader may have staged level 0 already; a new level 0 is staged after the change.
        if (shrinks) {
            std::filesystem::resize_file(color, 100);
        } else {
            test::Bytes damaged = test::ktx2_file(assets::PixelFormat::rgba8_srgb, 256, 256);
            damaged.back() ^= std::byte{1};
            scene.folder.write("quad_color.ktx2", damaged);
        }
        while (!streamer.upload({.bytes = 30000})) {
        }
        CHECK(streamer.texture("quad_color")->resident());
        CHECK(streamer.texture("sky")->complete());
        CHECK(streamer.mesh("quad_mesh")->best_level(0) == 0);
        if (streamer.failures().empty()) {
            CHECK(wrong_bytes(streamer) == 0); // staged before the change
        } else {
            CHECK(streamer.failures().size() == 1);
            CHECK_FALSE(streamer.texture("quad_color")->complete());
        }
        test::write_scene(scene.folder);
    }
    test::throw_on_error();
}

TEST_CASE("streamer: a file that was changed before its first piece is read again is named, and nothing is "
          "drawn of it") {
    if (!test::have_context()) {
        return;
    }
    const SmallScene scene;
    const std::filesystem::path color = scene.folder.path() / "quad_color.ktx2";
    for (const bool shrinks : {false, true}) {
        Streamer streamer(scene.file, SceneLoad(scene.file, scene.folder.path(), nullptr, {.ram_bytes = 0}));
        streamer.finish_checks(); // nothing is read again before the first upload
        if (shrinks) {
            std::filesystem::resize_file(color, 100);
        } else {
            test::Bytes damaged = test::ktx2_file(assets::PixelFormat::rgba8_srgb, 256, 256);
            damaged.back() ^= std::byte{1};
            scene.folder.write("quad_color.ktx2", damaged);
        }
        while (!streamer.upload({.bytes = 30000})) {
        }
        REQUIRE(streamer.failures().size() == 1);
        const std::string &message = streamer.failures().front();
        CHECK_MESSAGE(
            message.starts_with(color.string() + (shrinks ? ": ended at byte " : ": was changed while")),
            message);
        CHECK_FALSE(streamer.texture("quad_color")->resident());
        CHECK(streamer.texture("sky")->complete());
        test::write_scene(scene.folder);
    }
    test::throw_on_error();
}

TEST_CASE(
    "streamer: what is seen is drawn before the other files are read, and these are checked all the same") {
    if (!test::have_context()) {
        return;
    }
    const SmallScene scene;
    test::Bytes damaged = test::ktx2_file(assets::PixelFormat::rgba8_srgb, 256, 256);
    damaged.back() ^= std::byte{1};
    for (const NotReady not_ready : {NotReady::wait_if_seen, NotReady::skip}) {
        scene.folder.write("quad_color.ktx2", damaged); // only its header is good
        Streamer other(scene.file, SceneLoad(scene.file, scene.folder.path()));
        std::vector<Need> needs(other.piece_count());
        const auto [first, count] = other.pieces_of("quad_mesh");
        std::fill_n(needs.begin() + first, count, Need{2.0F, 0.0F});
        other.set_needs(needs);
        if (not_ready == NotReady::wait_if_seen) {
            CHECK_FALSE(other.upload({.not_ready = not_ready})); // a frame that shows the mesh only
            CHECK(other.mesh("quad_mesh")->best_level(0) == 0);
        }
        std::string message;
        try {
            while (!other.upload({.bytes = 30000, .not_ready = not_ready})) {
                std::this_thread::yield();
            }
            other.finish_checks();
        } catch (const Error &error) {
            message = error.what();
        }
        CHECK(message.find("quad_color.ktx2: is damaged or was replaced: its SHA-256 is ") !=
              std::string::npos);
        CHECK_FALSE(other.texture("quad_color")->resident());
        test::write_scene(scene.folder);
    }
    test::throw_on_error();
}

TEST_CASE("streamer: a large piece that is half uploaded gives way to one that is needed now") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    scene.put("quad_color", test::ktx2_file(assets::PixelFormat::rgba8_srgb, 1024, 1024)); // mip 0: 4 MB
    const UploadBudget frame{.bytes = 1 << 20, .not_ready = NotReady::wait_if_seen};
    Streamer streamer = scene.streamer();
    std::vector<Need> needs(streamer.piece_count());
    const auto [first, count] = streamer.pieces_of("quad_color");
    std::fill_n(needs.begin() + first, count, Need{0.0F, 2.0F});
    streamer.set_needs(needs);
    while (streamer.counts().uploads + 1 < count) {
        streamer.upload(frame);
    }
    streamer.upload(frame); // a part of mip 0
    REQUIRE_FALSE(streamer.texture("quad_color")->complete());
    CHECK_FALSE(streamer.texture("sky")->resident());
    const auto [sky, skies] = streamer.pieces_of("sky");
    std::fill_n(needs.begin() + sky, skies, Need{5.0F, 0.0F});
    streamer.set_needs(needs);
    streamer.upload(frame);
    CHECK(streamer.texture("sky")->complete());
    while (!streamer.upload(frame)) {
    }
    CHECK(streamer.texture("quad_color")->complete());
    CHECK(streamer.counts().resident_bytes == streamer.counts().total_bytes);
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
    Streamer streamer(scene.file, SceneLoad(scene.file, scene.folder.path(), nullptr, {.vram_bytes = limit}));
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
    std::vector<Need> needs(streamer.piece_count());
    const auto [first, count] = streamer.pieces_of("quad_color");
    std::fill_n(needs.begin() + first, count, Need{0.0F, 2.0F});
    streamer.set_needs(needs);
    while (allocated_bytes() - before < 6500000) { // mip 0 and the copy of the others
        upload();
    }
    REQUIRE_FALSE(streamer.texture("quad_color")->complete());
    const auto [sky, skies] = streamer.pieces_of("sky");
    std::fill_n(needs.begin() + sky, skies, Need{5.0F, 0.0F});
    streamer.set_needs(needs);
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
    Streamer streamer(scene.file, SceneLoad(scene.file, scene.folder.path(), nullptr, {.vram_bytes = limit}));
    std::vector<Need> needs(streamer.piece_count());
    const auto [color, colors] = streamer.pieces_of("quad_color");
    const auto [sky, skies] = streamer.pieces_of("sky");
    std::fill_n(needs.begin() + color, colors - 1, Need{2.0F, 0.0F});
    std::fill_n(needs.begin() + sky, skies - 1, Need{2.0F, 0.0F});
    streamer.set_needs(needs);
    REQUIRE(streamer.upload({}));
    // The first of the plan is not needed now, the second is.
    needs[color + colors - 1] = {0.0F, 9.0F};
    needs[sky + skies - 1] = {5.0F, 0.0F};
    streamer.set_needs(needs);
    while (!streamer.upload({.bytes = 1})) {
        CHECK(allocated_bytes() - before <= limit);
    }
    CHECK(streamer.counts().peak_bytes <= limit);
    CHECK(streamer.texture("sky")->complete());
    CHECK(streamer.texture("quad_color")->complete());
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
        CHECK(wrong_bytes(streamer) == 0);
    }
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
        Streamer streamer(scene.file, SceneLoad(scene.file, scene.folder.path(), nullptr, limits));
        const StreamedTexture *color = streamer.texture("quad_color");
        const auto [first, count] = streamer.pieces_of("quad_color");
        REQUIRE(count == 3); // 64 x 64 and coarser, 128 x 128, 256 x 256
        std::vector<Need> needs(streamer.piece_count());
        for (int round = 0; round < 3; ++round) {
            std::ranges::fill(needs, Need{2.0F, 0.0F});
            streamer.set_needs(needs);
            REQUIRE(streamer.upload({}));
            CHECK(color->complete());
            CHECK(wrong_bytes(streamer) == 0);
            CHECK(streamer.counts().worst_error == 0.0F);
            // Nothing is needed any more, but nothing else needs the memory either.
            std::ranges::fill(needs, Need{});
            streamer.set_needs(needs);
            streamer.upload({});
            CHECK(color->complete());
        }
        CHECK(streamer.counts().evictions == 0);
        CHECK(streamer.counts().peak_bytes <= 500000);
        test::throw_on_error();
    }
    // A limit that the finest mip exceeds: the rest is drawn, and the error is told.
    Streamer small(scene.file, SceneLoad(scene.file, scene.folder.path(), nullptr, {.vram_bytes = 150000}));
    const std::vector<Need> all(small.piece_count(), Need{3.0F, 0.0F});
    small.set_needs(all);
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
    Streamer streamer(scene.file,
                      SceneLoad(scene.file, scene.folder.path(), nullptr, {.vram_bytes = 750000}));
    const auto need = [&](std::string_view artifact) {
        std::vector<Need> needs(streamer.piece_count());
        const auto [first, count] = streamer.pieces_of(artifact);
        std::fill_n(needs.begin() + first, count, Need{2.0F, 0.0F});
        streamer.set_needs(needs);
        while (!streamer.upload({.bytes = 30000})) {
        }
        CHECK(streamer.texture(artifact)->complete());
        CHECK(streamer.counts().peak_bytes <= 750000);
    };
    for (int round = 0; round < 3; ++round) {
        need("quad_color");
        CHECK(wrong_bytes(streamer) == 0);
        need("sky");
        CHECK(streamer.texture("quad_color")->resident());
        CHECK_FALSE(streamer.texture("quad_color")->complete());
    }
    CHECK(streamer.counts().evictions >= 5);
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

TEST_CASE("textures: mutable storage holds the same texels as immutable storage") {
    if (!test::have_context()) {
        return;
    }
    for (const assets::PixelFormat format :
         {assets::PixelFormat::bc5_snorm, assets::PixelFormat::rg8_snorm, assets::PixelFormat::r16_unorm,
          assets::PixelFormat::bc4_unorm, assets::PixelFormat::rg16_snorm, assets::PixelFormat::rg16_unorm,
          assets::PixelFormat::bc7_srgb}) {
        const test::Bytes bytes = test::ktx2_file(format, 16, 8);
        const assets::Ktx2 ktx = assets::read_ktx2(bytes, "a.ktx2");
        const assets::UploadPlan plan = plan_texture(ktx);
        std::array<std::vector<float>, 2> texels;
        for (const Storage storage : {Storage::immutable, Storage::mutable_levels}) {
            const gl::Texture texture = allocate_texture(ktx, 0, storage);
            for (const assets::UploadChunk &chunk : plan.chunks) {
                upload_rows({texture, 0}, ktx, chunk, chunk.bytes.data());
            }
            std::vector<float> &out = texels[storage == Storage::immutable ? 0 : 1];
            out.resize(8 * 4 * 2);
            glGetTexImage(GL_TEXTURE_2D, 1, GL_RG, GL_FLOAT, out.data());
        }
        CHECK(texels[0] == texels[1]);
        CHECK(texels[0][0] != texels[0][2 * 5]); // the texels are not empty
    }
    test::throw_on_error();
}

TEST_CASE("textures: levels are copied between textures of other sizes, on the device and through memory") {
    if (!test::have_context()) {
        return;
    }
    for (const auto &[format, faces] :
         {std::pair(assets::PixelFormat::rgba8_unorm, 1U), std::pair(assets::PixelFormat::bc3_srgb, 1U),
          std::pair(assets::PixelFormat::rgba16_float, 6U), std::pair(assets::PixelFormat::bc5_snorm, 1U)}) {
        const test::Bytes bytes = test::ktx2_file(format, 32, 32, faces);
        const assets::Ktx2 ktx = assets::read_ktx2(bytes, "a.ktx2");
        const assets::UploadPlan plan = plan_texture(ktx);
        const unsigned target = faces == 6 ? GL_TEXTURE_CUBE_MAP : GL_TEXTURE_2D;
        const unsigned image = faces == 6 ? GL_TEXTURE_CUBE_MAP_POSITIVE_Y : GL_TEXTURE_2D;
        const gl::Texture whole = allocate_texture(ktx, 0, best_storage());
        for (const assets::UploadChunk &chunk : plan.chunks) {
            upload_rows({whole, 0}, ktx, chunk, chunk.bytes.data());
        }
        for (const auto copy : {copy_levels, copy_levels_by_memory}) {
            const gl::Texture coarse = allocate_texture(ktx, 2, best_storage()); // from 8 x 8 on
            copy(ktx, {whole, 0}, {coarse, 2});
            const gl::Texture finer = allocate_texture(ktx, 1, best_storage());
            copy(ktx, {coarse, 2}, {finer, 1});
            for (const auto &[texture, level] : {std::pair(&coarse, 1), std::pair(&finer, 2)}) { // 4 x 4
                std::vector<std::uint16_t> expected(4 * 4 * 4), found(4 * 4 * 4); // halves: NaN is equal
                glBindTexture(target, whole.name());
                glGetTexImage(image, 3, GL_RGBA, GL_HALF_FLOAT, expected.data());
                glBindTexture(target, texture->name());
                glGetTexImage(image, level, GL_RGBA, GL_HALF_FLOAT, found.data());
                CHECK(found == expected);
            }
        }
    }
    test::throw_on_error();
}

TEST_CASE(
    "textures: the coarsest level to sample stays the same level of the file while finer ones are missing") {
    if (!test::have_context()) {
        return;
    }
    const test::Bytes bytes = test::ktx2_file(assets::PixelFormat::rgba8_unorm, 32, 32); // six levels
    const assets::Ktx2 ktx = assets::read_ktx2(bytes, "a.ktx2");
    const auto coarsest = [&](std::uint32_t first_level, std::optional<int> max_level) {
        const gl::Texture texture = allocate_texture(ktx, first_level, best_storage());
        make_sampled(ktx, {texture, first_level}, max_level);
        GLint last = 0;
        glGetTexParameteriv(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, &last);
        return last + static_cast<GLint>(first_level);
    };
    CHECK(coarsest(0, 3) == 5); // whole textures are limited by their samplers
    CHECK(coarsest(1, 3) == 3);
    CHECK(coarsest(2, 3) == 3);
    CHECK(coarsest(4, 3) == 4); // nothing finer is there
    CHECK(coarsest(2, 31) == 5);
    CHECK(coarsest(2, std::nullopt) == 5);
    test::throw_on_error();
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

TEST_CASE("scene: visible instances are collected with a resident level, hidden ones are not") {
    if (!test::have_context()) {
        return;
    }
    const SmallScene small;
    Streamer streamer = small.streamer();
    const Scene scene(small.file, streamer);
    CHECK(scene.instance_count() == 1);
    CHECK(scene.objects()[0].materials[1].values.two_sided);       // leaf: found by name
    CHECK_FALSE(scene.objects()[0].materials[0].values.two_sided); // wood: default values
    View view;                                                     // planes of zero cull nothing
    std::vector<DrawItem> items;
    items.reserve(scene.instance_count());
    scene.collect(view, {0.0F, 0.0F, 5.0F}, 400.0F, 1.0F, items);
    CHECK(items.empty());             // nothing is resident
    streamer.upload({.bytes = 2200}); // the sky and the coarsest level of the mesh
    scene.collect(view, {0.0F, 0.0F, 5.0F}, 400.0F, 1.0F, items);
    REQUIRE(items.size() == 1);
    CHECK(items[0].lod == 1);
    view.planes[0] = {0.0F, 0.0F, 0.0F, -100.0F};
    items.clear();
    scene.collect(view, {0.0F, 0.0F, 5.0F}, 400.0F, 1.0F, items);
    CHECK(items.empty());
}

TEST_CASE("scene: a scene.json that disagrees with its meshes is rejected") {
    if (!test::have_context()) {
        return;
    }
    SmallScene small;
    small.file.objects[0].lods.pop_back();
    const Streamer streamer = small.streamer();
    CHECK_THROWS_AS(Scene(small.file, streamer), Error);
}
