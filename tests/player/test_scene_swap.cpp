#include "app/scene_swap.hpp"
#include "assets/watcher.hpp"
#include "context.hpp"
#include "error.hpp"
#include "files.hpp"
#include "gl/shader_library.hpp"
#include "render/renderer.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include <array>
#include <string>
#include <thread>

using namespace paradize;

namespace {

constexpr std::size_t everything = std::size_t{1} << 30U;

/// A scene's folder as bakes leave it: files with their hash in the name, scene.json renamed into its place.
struct BakedFolder {
    test::Folder folder;
    int color = 0; // the last quad_color

    BakedFolder() { bake(); }

    std::filesystem::path scene_json() const { return folder.path() / "scene.json"; }

    test::SceneText scene() const {
        test::SceneText out;
        const std::uint32_t edge = color % 2 == 0 ? 128 : 256;
        out.color_name = "quad_color-" + std::to_string(color) + ".ktx2";
        out.color_file = test::ktx2_file(assets::PixelFormat::rgba8_srgb, edge, edge);
        out.color_file[68] = static_cast<std::byte>(color); // of the metadata's place, which is not read
        return out;
    }

    void publish(const std::string &text) const {
        std::filesystem::rename(folder.write(".scene.json.part", text), scene_json());
    }

    /// Another picture; the last one is swept.
    void bake() {
        const std::string before = scene().color_name;
        ++color;
        const test::SceneText now = scene();
        if (color == 1) {
            test::write_scene(folder, now);
        }
        folder.write(now.color_name, now.color_file);
        publish(now.str());
        std::filesystem::remove(folder.path() / before);
    }
};

std::unique_ptr<assets::RebakedScene> wait_for(assets::SceneWatcher &rebaked) {
    std::unique_ptr<assets::RebakedScene> found;
    while (!(found = rebaked.take())) {
        std::this_thread::yield();
    }
    return found;
}

/// Uploads until a new scene is resident.
LoadedScene *wait_for(SceneSwap &acts) {
    LoadedScene *next = nullptr;
    while ((next = acts.upload(everything, Unready::wait)) == nullptr) {
        std::this_thread::yield();
    }
    return next;
}

/// Textures, buffers, vertex arrays, programs, framebuffers, samplers and renderbuffers that there are.
std::array<int, 7> objects() {
    std::array<int, 7> out{};
    for (GLuint name = 1; name < 4096; ++name) {
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

TEST_CASE("rebaked: a scene.json that takes another's place comes once, a broken one with its fault") {
    BakedFolder baked;
    assets::SceneWatcher rebaked(baked.scene_json());
    CHECK(rebaked.take() == nullptr);
    baked.bake();
    std::unique_ptr<assets::RebakedScene> found = wait_for(rebaked);
    CHECK(found->fault.empty());
    CHECK(found->file.find_artifact("quad_color")->file == "quad_color-2.ktx2");
    CHECK_FALSE(rebaked.outdated(found->stamp));
    CHECK(rebaked.take() == nullptr);
    baked.publish("{");
    CHECK(wait_for(rebaked)->fault.find("scene.json: is no JSON") != std::string::npos);
    CHECK(rebaked.outdated(found->stamp));
    baked.publish(R"({"format": "paradize-scene", "version": 99})");
    CHECK(wait_for(rebaked)->fault.find("version: is 99") != std::string::npos);
    baked.bake();
    CHECK(wait_for(rebaked)->fault.empty());
}

TEST_CASE("rebaked: what was replaced before the first scene.json was read is not missed") {
    BakedFolder baked;
    assets::SceneWatcher rebaked(baked.scene_json());
    baked.bake();
    const assets::SceneFile first = assets::read_scene(baked.scene_json());
    CHECK(wait_for(rebaked)->file.find_artifact("quad_color")->sha256 ==
          first.find_artifact("quad_color")->sha256);
}

TEST_CASE("acts: a new scene keeps what did not change, and shows when it is whole") {
    if (!test::have_context()) {
        return;
    }
    BakedFolder baked;
    assets::SceneWatcher rebaked(baked.scene_json());
    SceneSwap acts(ComingScene(assets::read_scene(baked.scene_json()), baked.folder.path()),
                   baked.folder.path(), &rebaked);
    while (!acts.now().streamer.complete()) {
        CHECK(acts.upload(everything, Unready::wait) == nullptr);
    }
    const StreamedMesh *mesh = acts.now().streamer.mesh("quad_mesh");
    const StreamedTexture *sky = acts.now().streamer.texture("sky");
    const StreamedTexture *color = acts.now().streamer.texture("quad_color");
    baked.bake();
    const LoadedScene *next = wait_for(acts);
    CHECK(acts.now().streamer.texture("quad_color") == color);
    CHECK(next->streamer.kept() == 2);
    CHECK(next->streamer.complete());
    CHECK(next->streamer.resident_bytes() == next->streamer.total_bytes());
    { const std::unique_ptr<LoadedScene> before = acts.turn(); }
    CHECK(&acts.now() == next);
    CHECK(acts.now().streamer.mesh("quad_mesh") == mesh);
    CHECK(acts.now().streamer.texture("sky") == sky);
    CHECK(sky->complete());
    CHECK(acts.now().streamer.texture("quad_color") != color);
    CHECK(acts.now().streamer.texture("quad_color")->width_px() == 128);
    test::demand_clean();
}

TEST_CASE("acts: a scene that cannot be shown leaves the one before, and the next takes its place") {
    if (!test::have_context()) {
        return;
    }
    BakedFolder baked;
    assets::SceneWatcher rebaked(baked.scene_json());
    SceneSwap acts(ComingScene(assets::read_scene(baked.scene_json()), baked.folder.path()),
                   baked.folder.path(), &rebaked);
    const LoadedScene *first = &acts.now();
    std::string text = baked.scene().str();
    text.replace(text.find("quad_color-1.ktx2"), 17, "quad_color-0.ktx2"); // which is not there
    baked.publish(text);
    baked.publish("[");
    baked.bake();
    wait_for(acts);
    CHECK(&acts.now() == first);
    acts.turn();
    CHECK(acts.now().file.find_artifact("quad_color")->file == "quad_color-2.ktx2");
    test::demand_clean();
}

TEST_CASE("acts: fifty scenes leave no object behind") {
    if (!test::have_context()) {
        return;
    }
    BakedFolder baked;
    const gl::ShaderLibrary shaders(gl::ShaderLibrary::find());
    RendererSettings settings;
    settings.width_px = 64;
    settings.height_px = 36;
    glUseProgram(0);
    const std::array<int, 7> none = objects();
    {
        assets::SceneWatcher rebaked(baked.scene_json());
        SceneSwap acts(ComingScene(assets::read_scene(baked.scene_json()), baked.folder.path()),
                       baked.folder.path(), &rebaked);
        auto renderer = std::make_unique<Renderer>(acts.now().scene, shaders, settings);
        while (!acts.now().streamer.complete()) {
            acts.upload(everything, Unready::wait);
        }
        renderer->draw(0.0, flight_pose(acts.now().file.flight, 0.0));
        const std::array<int, 7> first = objects();
        const std::uint64_t bytes = acts.now().streamer.resident_bytes();
        for (int i = 0; i < 50; ++i) {
            baked.bake();
            const LoadedScene *next = wait_for(acts);
            auto other = std::make_unique<Renderer>(next->scene, shaders, settings);
            const std::unique_ptr<LoadedScene> before = acts.turn();
            renderer = std::move(other);
            renderer->draw(0.1 * i, flight_pose(acts.now().file.flight, 0.1 * i));
        }
        CHECK(objects() == first);
        CHECK(acts.now().streamer.resident_bytes() == bytes); // of the same size again
    }
    glUseProgram(0); // one in use stays until then
    CHECK(objects() == none);
    test::demand_clean();
}
