#pragma once
// The small scene of files.hpp, baked into a folder of its own, for tests that stream it.

#include "assets/scene/file.hpp"
#include "files.hpp"
#include "streaming/streamer.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace paradize::test {

struct SmallScene {
    Folder folder;
    assets::SceneFile file = assets::parse_scene(SceneText().str(), "scene.json");

    SmallScene() { write_scene(folder); }
    [[nodiscard]] Streamer streamer(const MemoryLimits &limits = {}) const {
        return Streamer(file, SceneLoad(file, folder.path(), nullptr, limits));
    }
    /// Replaces the file of an artifact, as a bake does.
    void put(const std::string &name, const Bytes &bytes) {
        const auto entry = std::ranges::find(file.artifacts, name, &assets::Artifact::name);
        folder.write(entry->file, bytes);
        entry->sha256 = sha256_of(bytes);
        entry->bytes = bytes.size();
    }
    /// Changes the last byte of quad_color's file, whose size and hash in scene.json stay.
    void damage_color() const {
        Bytes damaged = ktx2_file(assets::PixelFormat::rgba8_srgb, 256, 256);
        damaged.back() ^= std::byte{1};
        folder.write("quad_color.ktx2", damaged);
    }
};

/// How much a test needs of a streamer's pieces; nothing at first. The streamer is told of each change.
class Needs {
  public:
    explicit Needs(Streamer &streamer) : streamer_(&streamer), pieces_(streamer.piece_count()) {}

    void set_all(const Need &need) {
        std::ranges::fill(pieces_, need);
        streamer_->set_needs(pieces_);
    }
    /// Of the pieces of an artifact, the `most` coarsest.
    void set(std::string_view artifact, const Need &need, std::uint32_t most = UINT32_MAX) {
        const auto [first, count] = streamer_->pieces_of(artifact);
        std::fill_n(pieces_.begin() + first, std::min(count, most), need);
        streamer_->set_needs(pieces_);
    }
    void set_finest(std::string_view artifact, const Need &need) {
        const auto [first, count] = streamer_->pieces_of(artifact);
        pieces_[first + count - 1] = need;
        streamer_->set_needs(pieces_);
    }

  private:
    Streamer *streamer_;
    std::vector<Need> pieces_;
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
