// From a scene's files to all of it on the device: by the player, or by a loader that reads each file whole
// and uploads its bytes, without a check, on one thread. Prints milliseconds as JSON. paradize-resident
// FOLDER ours|peer

#include "assets/ktx2.hpp"
#include "assets/scene/file.hpp"
#include "assets/upload_plan.hpp"
#include "gl/buffer.hpp"
#include "gl/device_memory.hpp"
#include "gl/headless.hpp"
#include "streaming/streamer.hpp"
#include "streaming/texture_format.hpp"

#include <epoxy/gl.h>

#include <ctime>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

using namespace paradize;

namespace {

double seconds(clockid_t clock) {
    timespec now{};
    ::clock_gettime(clock, &now);
    return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

void load_ours(const assets::SceneFile &scene, const std::filesystem::path &folder) {
    Streamer streamer(scene, folder);
    while (!streamer.upload({})) {
    }
    streamer.finish_checks();
    if (!streamer.complete()) {
        throw std::runtime_error("not all is resident");
    }
    glFinish();
}

void load_barely(const assets::SceneFile &scene, const std::filesystem::path &folder) {
    std::vector<gl::Texture> textures;
    std::vector<gl::Buffer> buffers;
    for (const assets::Artifact &artifact : scene.artifacts) {
        if (!artifact.drawn || artifact.kind == assets::ArtifactKind::sound) {
            continue;
        }
        std::vector<std::byte> bytes(artifact.bytes);
        std::ifstream file(folder / artifact.file, std::ios::binary);
        if (!file.read(reinterpret_cast<char *>(bytes.data()), static_cast<std::streamsize>(bytes.size()))) {
            throw std::runtime_error(artifact.file + ": cannot be read");
        }
        if (artifact.file.ends_with(".ktx2")) {
            const assets::Ktx2 ktx = assets::read_ktx2_front(bytes, artifact.file);
            textures.push_back(allocate_texture(ktx, 0, best_storage()));
            for (const assets::UploadChunk &chunk : assets::plan_texture(ktx).chunks) {
                upload_rows({textures.back()}, ktx, chunk, {chunk.bytes.data()});
            }
        } else {
            buffers.push_back(gl::make_buffer(GL_ARRAY_BUFFER, bytes.size(), gl::Usage::fixed));
            gl::write_buffer(GL_ARRAY_BUFFER, buffers.back(), 0, bytes);
        }
    }
    glFinish();
}

} // namespace

int main(int argc, char **argv) {
    const std::string who = argc == 3 ? argv[2] : "";
    if (who != "ours" && who != "peer") {
        std::cerr << "paradize-resident FOLDER ours|peer\n";
        return 2;
    }
    const std::filesystem::path folder = argv[1];
    const gl::HeadlessContext context(false);
    const assets::SceneFile scene = assets::read_scene(folder / "scene.json");
    if (who == "ours") {
        gl::keep_deleted_memory(); // as the player does
    }
    const double wall_s = seconds(CLOCK_MONOTONIC);
    const double processor_s = seconds(CLOCK_PROCESS_CPUTIME_ID);
    (who == "ours" ? load_ours : load_barely)(scene, folder);
    std::cout << "{\"ms\": " << (seconds(CLOCK_MONOTONIC) - wall_s) * 1e3
              << ", \"processor_ms\": " << (seconds(CLOCK_PROCESS_CPUTIME_ID) - processor_s) * 1e3 << "}\n";
}
