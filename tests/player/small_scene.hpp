#pragma once
// The small scene of files.hpp, baked into a folder of its own, for tests that stream it.

#include "assets/scene/file.hpp"
#include "files.hpp"
#include "streaming/streamer.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <string>
#include <vector>

namespace paradize::test {

struct SmallScene {
    Folder folder;
    assets::SceneFile file = assets::parse_scene(SceneText().str(), "scene.json");

    SmallScene() { write_scene(folder); }
    [[nodiscard]] Streamer streamer() const { return Streamer(file, folder.path()); }
    /// Replaces the file of an artifact, as a bake does.
    void put(const std::string &name, const Bytes &bytes) {
        const auto entry = std::ranges::find(file.artifacts, name, &assets::Artifact::name);
        folder.write(entry->file, bytes);
        entry->sha256 = sha256_of(bytes);
        entry->bytes = bytes.size();
    }
};

/// Number of bytes of quad_color on the device that differ from its file.
inline int wrong_bytes(const Streamer &streamer) {
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

} // namespace paradize::test
