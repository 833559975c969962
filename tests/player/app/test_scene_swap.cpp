#include "app/scene_swap.hpp"
#include "assets/watcher.hpp"
#include "context.hpp"
#include "error.hpp"
#include "files.hpp"
#include "gl/shader_library.hpp"
#include "render/renderer.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <string>
#include <thread>

using namespace paradize;

namespace {

constexpr std::size_t everything = std::size_t{1} << 30U;

/// A scene folder like those of the bake: hashes in file names, scene.json replaced by renaming.
struct BakedFolder {
    test::Folder folder;
    int color = 0; // of the last quad_color

    BakedFolder() { bake(); }

    std::filesystem::path scene_json() const { return folder.path() / "scene.json"; }

    test::SceneText scene() const {
        test::SceneText out;
        const std::uint32_t edge = color % 2 == 0 ? 128 : 256;
        out.color_name = "quad_color-" + std::to_string(color) + ".ktx2";
        out.color_file = test::ktx2_file(assets::PixelFormat::rgba8_srgb, edge, edge);
        out.color_file[68] = static_cast<std::byte>(color); // in the metadata, which is not read
        return out;
    }

    void publish(const std::string &text) const {
        std::filesystem::rename(folder.write(".scene.json.part", text), scene_json());
    }

    /// Writes another colour map and deletes the previous one.
    void bake() {
        const std::string before = scene().color_name;
        ++color;
        const test::SceneText current = scene();
        if (color == 1) {
            test::write_scene(folder, current);
        }
        folder.write(current.color_name, current.color_file);
        publish(current.str());
        std::filesystem::remove(folder.path() / before);
    }
};

std::unique_ptr<assets::SceneUpdate> wait_for(assets::SceneWatcher &watcher) {
    std::unique_ptr<assets::SceneUpdate> found;
    while (!(found = watcher.take())) {
        std::this_thread::yield();
    }
    return found;
}

const CameraForecast forecast{.width_px = 64, .height_px = 64};

/// Uploads until a new scene is resident.
LoadedScene *wait_for(SceneSwap &scenes) {
    LoadedScene *next = nullptr;
    while ((next = scenes.upload(forecast, {})) == nullptr) {
        std::this_thread::yield();
    }
    return next;
}

/// Numbers of existing textures, buffers, vertex arrays, programs, framebuffers, samplers and renderbuffers.
std::array<int, 7> objects() {
    std::array<int, 7> out{};
    for (unsigned name = 1, end = test::names_end(); name < end; ++name) {
        const std::array<GLboolean, 7> is{glIsTexture(name),     glIsBuffer(name),      glIsVertexArray(name),
                                          glIsProgram(name),     glIsFramebuffer(name), glIsSampler(name),
                                          glIsRenderbuffer(name)};
        for (std::size_t i = 0; i < is.size(); ++i) {
            out[i] += is[i] == GL_TRUE ? 1 : 0;
        }
    }
    return out;
}

} // namespace

TEST_CASE("scene watcher: a replaced scene.json gives one update, a broken one gives its error") {
    BakedFolder baked;
    assets::SceneWatcher watcher(baked.scene_json());
    CHECK(watcher.take() == nullptr);
    baked.bake();
    std::unique_ptr<assets::SceneUpdate> found = wait_for(watcher);
    CHECK(found->error.empty());
    CHECK(found->file.find_artifact("quad_color")->file == "quad_color-2.ktx2");
    CHECK_FALSE(watcher.outdated(found->stamp));
    CHECK(watcher.take() == nullptr);
    baked.publish("{");
    CHECK(wait_for(watcher)->error.find("scene.json: is not valid JSON") != std::string::npos);
    CHECK(watcher.outdated(found->stamp));
    baked.publish(R"({"format": "paradize-scene", "version": 99})");
    CHECK(wait_for(watcher)->error.find("version: is 99") != std::string::npos);
    baked.bake();
    CHECK(wait_for(watcher)->error.empty());
}

TEST_CASE("scene watcher: a change before the first scene.json is read is not missed") {
    BakedFolder baked;
    assets::SceneWatcher watcher(baked.scene_json());
    baked.bake();
    const assets::SceneFile first = assets::read_scene(baked.scene_json());
    CHECK(wait_for(watcher)->file.find_artifact("quad_color")->sha256 ==
          first.find_artifact("quad_color")->sha256);
}

TEST_CASE("scene swap: a new scene reuses unchanged artifacts and is shown when it is complete") {
    if (!test::have_context()) {
        return;
    }
    BakedFolder baked;
    assets::SceneWatcher watcher(baked.scene_json());
    SceneSwap scenes(PendingScene(assets::read_scene(baked.scene_json()), baked.folder.path()),
                     baked.folder.path(), {}, &watcher);
    while (!scenes.current().streamer.complete()) {
        CHECK(scenes.upload(forecast, {}) == nullptr);
    }
    const StreamedMesh *mesh = scenes.current().streamer.mesh("quad_mesh");
    const StreamedTexture *sky = scenes.current().streamer.texture("sky");
    const StreamedTexture *color = scenes.current().streamer.texture("quad_color");
    baked.bake();
    LoadedScene *next = wait_for(scenes);
    CHECK(scenes.current().streamer.texture("quad_color") == color);
    CHECK(next->streamer.reused() == 2);
    CHECK(next->streamer.complete());
    CHECK(next->streamer.counts().resident_bytes == next->streamer.counts().total_bytes);
    { const std::unique_ptr<LoadedScene> before = scenes.activate(); }
    CHECK(&scenes.current() == next);
    CHECK(scenes.current().streamer.mesh("quad_mesh") == mesh);
    CHECK(scenes.current().streamer.texture("sky") == sky);
    CHECK(sky->complete());
    CHECK(scenes.current().streamer.texture("quad_color") != color);
    CHECK(scenes.current().streamer.texture("quad_color")->width_px() == 128);
    test::throw_on_error();
}

TEST_CASE("scene swap: what the scene before did not draw, and all under a limit, is loaded anew") {
    if (!test::have_context()) {
        return;
    }
    const BakedFolder baked;
    for (const bool limited : {false, true}) {
        assets::SceneFile first = assets::read_scene(baked.scene_json());
        if (!limited) {
            first.objects.clear();
            for (const char *name : {"quad_mesh", "quad_color"}) {
                std::ranges::find(first.artifacts, name, &assets::Artifact::name)->drawn = false;
            }
        }
        Streamer before(first, baked.folder.path());
        before.finish_checks();
        before.upload({});
        REQUIRE(before.complete());
        const assets::SceneFile second = assets::read_scene(baked.scene_json());
        const MemoryLimits limits{.vram_bytes = limited ? std::uint64_t{1} << 30U : 0};
        Streamer after(second, SceneLoad(second, baked.folder.path(), &before, limits));
        CHECK(after.reused() == (limited ? 0 : 1)); // the sky
        after.upload({});
        CHECK(after.texture("quad_color")->width_px() == 256);
        CHECK(after.mesh("quad_mesh")->levels().size() == 2);
    }
    test::throw_on_error();
}

TEST_CASE("scene swap: a broken scene leaves the previous one, and a later scene replaces it") {
    if (!test::have_context()) {
        return;
    }
    BakedFolder baked;
    assets::SceneWatcher watcher(baked.scene_json());
    SceneSwap scenes(PendingScene(assets::read_scene(baked.scene_json()), baked.folder.path()),
                     baked.folder.path(), {}, &watcher);
    const LoadedScene *first = &scenes.current();
    while (!scenes.current().streamer.complete()) { // the next bake deletes its files
        scenes.upload(forecast, {});
    }
    test::SceneText broken = baked.scene();
    broken.color_name = "quad_color-0.ktx2"; // a file that does not exist
    broken.color_file[68] = std::byte{0};    // nor is its content loaded: that would be used again
    baked.publish(broken.str());
    baked.publish("[");
    baked.bake();
    wait_for(scenes);
    CHECK(&scenes.current() == first);
    scenes.activate();
    CHECK(scenes.current().file.find_artifact("quad_color")->file == "quad_color-2.ktx2");
    test::throw_on_error();
}

TEST_CASE("scene swap: a file that a newer bake removed ends playback only if the newer scene is broken") {
    if (!test::have_context()) {
        return;
    }
    BakedFolder baked;
    assets::SceneWatcher watcher(baked.scene_json());
    SceneSwap scenes(PendingScene(assets::read_scene(baked.scene_json()), baked.folder.path()),
                     baked.folder.path(), {}, &watcher);
    const LoadedScene *first = &scenes.current();
    baked.bake();
    wait_for(watcher); // this update is lost, as if it took long to read
    CHECK(scenes.upload(forecast, {}) == nullptr);
    CHECK_FALSE(scenes.current().streamer.complete());
    CHECK(&scenes.current() == first);
    SUBCASE("a sound one is shown") {
        baked.bake();
        const LoadedScene *next = wait_for(scenes);
        scenes.activate();
        CHECK(&scenes.current() == next);
        CHECK(scenes.current().file.find_artifact("quad_color")->file == "quad_color-3.ktx2");
    }
    SUBCASE("a broken one, or none at all, ends it") {
        SUBCASE("a broken one") {
            baked.publish("[");
        }
        SUBCASE("none") {
            std::filesystem::remove(baked.scene_json());
        }
        const auto play = [&] {
            while (scenes.upload(forecast, {}) == nullptr) {
                std::this_thread::yield();
            }
        };
        CHECK_THROWS_AS(play(), Error);
    }
    test::throw_on_error();
}

TEST_CASE("scene swap: fifty scenes leave no GL object behind") {
    if (!test::have_context()) {
        return;
    }
    BakedFolder baked;
    const gl::ShaderLibrary shaders(gl::ShaderLibrary::find());
    RendererOptions options;
    options.width_px = 64;
    options.height_px = 36;
    glUseProgram(0);
    const std::array<int, 7> none = objects();
    {
        assets::SceneWatcher watcher(baked.scene_json());
        SceneSwap scenes(PendingScene(assets::read_scene(baked.scene_json()), baked.folder.path()),
                         baked.folder.path(), {}, &watcher);
        auto renderer = std::make_unique<Renderer>(scenes.current().scene, shaders, options);
        while (!scenes.current().streamer.complete()) {
            scenes.upload(forecast, {});
        }
        renderer->draw(0.0, flight_pose(scenes.current().file.flight, 0.0));
        const std::array<int, 7> first = objects();
        const std::uint64_t bytes = scenes.current().streamer.counts().resident_bytes;
        for (int i = 0; i < 50; ++i) {
            baked.bake();
            LoadedScene *next = wait_for(scenes);
            auto other = std::make_unique<Renderer>(next->scene, shaders, options);
            const std::unique_ptr<LoadedScene> before = scenes.activate();
            renderer = std::move(other);
            renderer->draw(0.1 * i, flight_pose(scenes.current().file.flight, 0.1 * i));
        }
        CHECK(objects() == first);
        CHECK(scenes.current().streamer.counts().resident_bytes == bytes); // the size is unchanged
    }
    glUseProgram(0); // a program in use is deleted only then
    CHECK(objects() == none);
    test::throw_on_error();
}
