// Files that change, shrink, vanish or are damaged while a scene streams, or were checked by an earlier
// start.
#include "assets/checked_files.hpp"
#include "assets/scene/file.hpp"
#include "context.hpp"
#include "error.hpp"
#include "files.hpp"
#include "small_scene.hpp"
#include "streaming/streamer.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

using namespace paradize;
using paradize::test::SmallScene;

namespace {

/// While it lives, an earlier start has checked the files of a scene as they are now.
class CheckedBefore {
  public:
    explicit CheckedBefore(const SmallScene &scene) {
        ::setenv("PARADIZE_CHECKED", records_.path().c_str(), 1);
        constexpr std::int64_t minute_ns = 60'000'000'000;
        assets::CheckedFiles files(scene.folder.path());
        for (const assets::Artifact &artifact : scene.file.artifacts) {
            files.add(artifact, assets::stamp_of(scene.folder.path() / artifact.file),
                      assets::now_ns() + minute_ns);
        }
        files.save(true);
    }
    ~CheckedBefore() { ::setenv("PARADIZE_CHECKED", "", 1); }
    CheckedBefore(const CheckedBefore &) = delete;
    CheckedBefore &operator=(const CheckedBefore &) = delete;

  private:
    const test::Folder records_;
};

/// The hashes are not those of the files any more, which whoever hashes one finds.
void hash_falsely(SmallScene &scene) {
    for (assets::Artifact &artifact : scene.file.artifacts) {
        artifact.sha256 = std::string(64, '0');
    }
}

/// Changes the file of quad_color: cuts it, or changes its last byte.
void change_color(const SmallScene &scene, bool shrinks) {
    if (shrinks) {
        std::filesystem::resize_file(scene.folder.path() / "quad_color.ktx2", 100);
    } else {
        scene.damage_color();
    }
}

/// Counts objects of the device. is_one: glIsTexture() or alike.
template <class IsOne>
std::ptrdiff_t count_objects(IsOne is_one) {
    constexpr unsigned most = 10000;
    std::ptrdiff_t found = 0;
    for (unsigned name = 1; name < most; ++name) {
        found += is_one(name) != GL_FALSE ? 1 : 0;
    }
    return found;
}

/// Uploads all. Returns the error, or an empty text.
std::string load_error(const SmallScene &scene) {
    try {
        Streamer streamer = scene.streamer();
        streamer.upload({});
        streamer.finish_checks();
        CHECK(test::wrong_bytes(streamer) == 0);
    } catch (const Error &error) {
        return error.what();
    }
    return "";
}

} // namespace

TEST_CASE("streamer: a file that an earlier start has checked is not hashed again, until it is replaced") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    scene.put("sky", test::zstd_ktx2_file(assets::PixelFormat::rgba8_unorm, 8, 8, 6));
    hash_falsely(scene);
    CHECK(load_error(scene).find("its SHA-256 is") != std::string::npos);
    const CheckedBefore checked(scene);
    CHECK(load_error(scene).empty());
    CHECK(load_error(scene).empty()); // the record stays
    const std::string color = "quad_color.ktx2";
    scene.folder.write(color, test::ktx2_file(assets::PixelFormat::rgba8_srgb, 256, 256));
    CHECK(load_error(scene).find(color + ": is damaged or was replaced") != std::string::npos);
    test::throw_on_error();
}

TEST_CASE("streamer: what cannot be drawn is named, also in a file that an earlier start has checked") {
    if (!test::have_context()) {
        return;
    }
    const test::Bytes floats = test::ktx2_file(assets::PixelFormat::r32_float, 256, 256); // up to 3e38
    const test::Bytes frames = test::zstd_ktx2_file(assets::PixelFormat::rgba8_srgb, 256, 256);
    const test::Bytes frame(100, std::byte{1});
    const std::vector<std::tuple<std::string, test::Bytes, std::string>> wrong{
        {"quad_color", floats, "quad_color.ktx2: level "},
        {"quad_color", test::with_frame(frames, frame), "quad_color.ktx2: level 0: "},
        {"quad_mesh", test::glb_file(test::glb_json(), 99), "quad_mesh.glb: "}};
    for (const auto &[name, file, message] : wrong) {
        SmallScene scene;
        scene.put(name, file);
        const std::string first = load_error(scene);
        CHECK_MESSAGE(first.find(message) != std::string::npos, first);
        const CheckedBefore checked(scene);
        const std::string later = load_error(scene);
        CHECK_MESSAGE(later.find(message) != std::string::npos, later);
    }
    test::throw_on_error();
}

TEST_CASE("streamer: a wrong file is named in each call, and none leaves anything of it on the device") {
    if (!test::have_context()) {
        return;
    }
    for (const bool before : {false, true}) { // its check fails, or that of a level once it is read
        SmallScene scene;
        scene.put("quad_mesh", test::glb_file(test::glb_json(), 99));
        std::optional<CheckedBefore> checked;
        if (before) {
            checked.emplace(scene);
        }
        Streamer streamer = scene.streamer();
        test::Needs needs(streamer);
        needs.set("quad_mesh", {2.0F, 0.0F});
        const std::ptrdiff_t vertex_arrays = count_objects(glIsVertexArray);
        for (int call = 0; call < 3; ++call) { // a player goes on where a newer scene is about to come
            CHECK_THROWS_WITH_AS(streamer.upload({.not_ready = NotReady::wait_if_seen}),
                                 doctest::Contains("quad_mesh.glb: "), Error);
            // Of the file that was checked before, the coarser level is right.
            CHECK(count_objects(glIsVertexArray) == vertex_arrays + (before ? 1 : 0));
        }
    }
    test::throw_on_error();
}

TEST_CASE("streamer: of a file that is lost before anything of it is drawn, nothing is left on the device") {
    if (!test::have_context()) {
        return;
    }
    std::vector<std::ptrdiff_t> textures;
    std::vector<std::ptrdiff_t> vertex_arrays;
    for (const std::string lost : {"", "quad_color.ktx2", "quad_mesh.glb"}) {
        const SmallScene scene;
        Streamer streamer = scene.streamer({.vram_bytes = 100000000, .ram_bytes = 0});
        streamer.finish_checks();
        if (!lost.empty()) {
            std::filesystem::resize_file(scene.folder.path() / lost, 100);
        }
        test::Needs(streamer).set_all({2.0F, 0.0F});
        while (!streamer.upload({.bytes = 30000})) {
        }
        CHECK(streamer.failures().size() == (lost.empty() ? 0 : 1));
        textures.push_back(count_objects(glIsTexture));
        vertex_arrays.push_back(count_objects(glIsVertexArray));
    }
    constexpr std::ptrdiff_t mesh_levels = 2;
    CHECK(textures[1] == textures[0] - 1);
    CHECK(textures[2] == textures[0]);
    CHECK(vertex_arrays[1] == vertex_arrays[0]);
    CHECK(vertex_arrays[2] == vertex_arrays[0] - mesh_levels);
    test::throw_on_error();
}

TEST_CASE("streamer: what a scene takes over from the one before stays known to the next start") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    hash_falsely(scene);
    const CheckedBefore checked(scene);
    {
        const assets::SceneFile first = scene.file;
        Streamer before(first, scene.folder.path());
        before.upload({});
        scene.put("quad_color", test::zstd_ktx2_file(assets::PixelFormat::rgba8_srgb, 256, 256));
        Streamer after(scene.file, scene.folder.path(), &before);
        after.upload({});
        after.finish_checks();
        CHECK(after.reused() > 0);
    }
    CHECK(load_error(scene).empty());
    test::throw_on_error();
}

TEST_CASE("streamer: an end before all files are checked forgets none that were") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    hash_falsely(scene);
    const CheckedBefore checked(scene);
    {
        const Streamer ended = scene.streamer(); // none is needed yet
    }
    CHECK(load_error(scene).empty());
    test::throw_on_error();
}

TEST_CASE("streamer: a file that an earlier start has checked and that shrinks gives one message, the others "
          "are drawn") {
    if (!test::have_context()) {
        return;
    }
    const SmallScene scene;
    const CheckedBefore checked(scene);
    Streamer streamer = scene.streamer();
    streamer.finish_checks();
    std::filesystem::resize_file(scene.folder.path() / "quad_color.ktx2", 100);
    while (!streamer.upload({.bytes = 30000})) {
    }
    REQUIRE(streamer.failures().size() == 1);
    CHECK(streamer.failures()[0].find("quad_color.ktx2: ended at byte ") != std::string::npos);
    CHECK(streamer.mesh("quad_mesh")->best_level(0) == 0);
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
        CHECK(test::wrong_bytes(streamer) == 0);
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
        Streamer streamer = scene.streamer({.ram_bytes = 0});
        streamer.finish_checks();
        for (const assets::Artifact &artifact : scene.file.artifacts) {
            std::filesystem::remove(scene.folder.path() / artifact.file);
        }
        while (!streamer.upload({.bytes = 30000})) {
        }
        CHECK(test::wrong_bytes(streamer) == 0);
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
    for (const bool shrinks : {false, true}) {
        Streamer streamer = scene.streamer({.ram_bytes = 0});
        streamer.upload({.bytes = 30000}); // the coarse mips
        streamer.finish_checks();
        CHECK(streamer.failures().empty());
        // The loader may have staged level 0 already; a new level 0 is staged after the change.
        change_color(scene, shrinks);
        while (!streamer.upload({.bytes = 30000})) {
        }
        CHECK(streamer.texture("quad_color")->resident());
        CHECK(streamer.texture("sky")->complete());
        CHECK(streamer.mesh("quad_mesh")->best_level(0) == 0);
        if (streamer.failures().empty()) {
            CHECK(test::wrong_bytes(streamer) == 0); // staged before the change
        } else {
            CHECK(streamer.failures().size() == 1);
            CHECK_FALSE(streamer.texture("quad_color")->complete());
        }
        test::write_scene(scene.folder);
    }
    test::throw_on_error();
}

TEST_CASE(
    "streamer: a headless frame waits for no piece that is not seen yet and was not planned before it") {
    if (!test::have_context()) {
        return;
    }
    const SmallScene scene;
    Streamer streamer = scene.streamer({.vram_bytes = 100000000, .ram_bytes = 0});
    test::Needs needs(streamer);
    const UploadBudget frame{.not_ready = NotReady::wait_if_seen};
    needs.set("quad_color", {2.0F, 0.0F}, 1);
    streamer.upload(frame); // checks the file
    const std::uint64_t before = streamer.counts().uploads;
    needs.set("quad_color", {2.0F, 2.0F});
    needs.set_finest("quad_color", {0.0F, 2.0F}); // mip 0, which is read from its file
    streamer.upload(frame);
    CHECK(streamer.counts().uploads == before + streamer.pieces_of("quad_color").second - 2); // what is seen
    CHECK_FALSE(streamer.texture("quad_color")->complete());
    streamer.upload(frame);
    CHECK(streamer.texture("quad_color")->complete());
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
        Streamer streamer = scene.streamer({.ram_bytes = 0});
        streamer.finish_checks(); // nothing is read again before the first upload
        change_color(scene, shrinks);
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
    for (const NotReady not_ready : {NotReady::wait_if_seen, NotReady::skip}) {
        scene.damage_color(); // its header is good
        Streamer other = scene.streamer();
        test::Needs needs(other);
        needs.set("quad_mesh", {2.0F, 0.0F});
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

TEST_CASE("streamer: a file that is lost gives one message, however often its pieces come and go") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    scene.put("sky", test::ktx2_file(assets::PixelFormat::rgba8_unorm, 128, 128, 6)); // 393 kB and coarser
    Streamer streamer = scene.streamer({.vram_bytes = 700000, .ram_bytes = 0});
    const auto need = [&](std::string_view artifact, std::uint32_t pieces) {
        test::Needs needs(streamer);
        needs.set(artifact, {2.0F, 0.0F}, pieces);
        while (!streamer.upload({.bytes = 30000})) {
        }
    };
    need("quad_color", 2); // mip 1 and coarser
    std::filesystem::resize_file(scene.folder.path() / "quad_color.ktx2", 100);
    for (int round = 0; round < 3; ++round) {
        need("quad_color", 3);
        CHECK(streamer.failures().size() == 1);
        CHECK(streamer.texture("quad_color")->resident());
        need("sky", 2); // takes the room of mip 1
        CHECK(streamer.texture("sky")->complete());
        CHECK(streamer.texture("quad_color")->finest() == 2);
    }
    CHECK_FALSE(streamer.complete());
    test::throw_on_error();
}

TEST_CASE("streamer: how far the threads have come does not change what a headless frame uploads") {
    if (!test::have_context()) {
        return;
    }
    SmallScene scene;
    scene.put("sky", test::ktx2_file(assets::PixelFormat::rgba8_unorm, 1024, 1024, 6)); // 33 MB
    constexpr std::uint64_t little = std::uint64_t{17} << 20U; // holds the other files, beside the buffer
    std::optional<CheckedBefore> checked;
    for (const auto &[ram_bytes, second_start] :
         {std::pair(MemoryLimits().ram_bytes, false), std::pair(MemoryLimits().ram_bytes, true),
          std::pair(little, false)}) {
        checked.reset();
        if (second_start) {
            checked.emplace(scene);
        }
        const MemoryLimits limits{.vram_bytes = 200000000, .ram_bytes = ram_bytes};
        Streamer streamer = scene.streamer(limits);
        test::Needs needs(streamer);
        const auto upload = [&](std::size_t bytes) {
            streamer.upload({.bytes = bytes, .not_ready = NotReady::wait_if_seen});
        };
        needs.set("sky", {0.0F, 2.0F});
        upload(streamer.piece(streamer.pieces_of("sky").first).bytes);
        REQUIRE(streamer.texture("sky")->resident());
        streamer.finish_checks(); // as if the threads were fast; a slow one has not checked the next file
        needs.set("quad_color", {0.0F, 9.0F}, 1);
        upload(1 << 20);
        CHECK_FALSE(streamer.texture("quad_color")->resident());
        upload(2 << 20);
        REQUIRE(streamer.texture("quad_color")->resident());
        // A file that frames have used lies in memory if all files have room there. Else it depends on which
        // of them was checked first.
        needs.set("quad_color", {0.0F, 9.0F});
        upload(64 << 20);
        CHECK(streamer.texture("quad_color")->complete() == (ram_bytes != little));
        upload(1 << 20);
        CHECK(streamer.texture("quad_color")->complete());
    }
    test::throw_on_error();
}
