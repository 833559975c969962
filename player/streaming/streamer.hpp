#pragma once
// Brings baked files to the GPU: read and checked by threads, uploaded within a byte budget per frame, coarse
// first.

#include "assets/scene_file.hpp"
#include "gl/handle.hpp"
#include "streaming/streamed_mesh.hpp"
#include "streaming/streamed_tile.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace paradize::assets {
class ArtifactLoader;
}

namespace paradize {

/// A texture that becomes finer while the player runs. Before its first level arrives bind() gives a neutral
/// texel (mid grey; for SNORM maps zero, that is a flat normal and no shake).
class StreamedTexture {
  public:
    /// Binds to a unit. `sampler` 0 takes the texture's own parameters: repeat, trilinear (cube maps: clamp).
    void bind(unsigned unit, unsigned sampler = 0) const;
    unsigned target() const { return target_; } // GL_TEXTURE_2D or GL_TEXTURE_CUBE_MAP
    int width_px() const { return width_px_; }
    int height_px() const { return height_px_; }
    int levels() const { return levels_; }
    bool resident() const { return finest_ < levels_; } // something is there
    bool complete() const { return finest_ == 0; }      // all is there

  private:
    friend class Streamer;
    gl::Texture texture_;
    gl::Texture fallback_;
    unsigned target_ = 0;
    int width_px_ = 0, height_px_ = 0, levels_ = 0;
    int finest_ = 0; // the finest level that is resident; levels_: none
};

enum class NotReady { wait, skip };

class Streamer;
struct StreamItem;

/// How many bytes of files wait in memory for their upload, besides what is coarse and the file that is
/// uploaded.
inline constexpr std::uint64_t max_waiting_bytes = std::uint64_t{256} << 20U;

/// A scene's files while threads read and check them. What `before` has whole (by its SHA-256) is kept.
class SceneLoad {
  public:
    /// `file` outlives this.
    SceneLoad(const assets::SceneFile &file, const std::filesystem::path &folder,
              const Streamer *before = nullptr, std::uint64_t max_waiting = max_waiting_bytes);
    SceneLoad(SceneLoad &&) noexcept;
    SceneLoad &operator=(SceneLoad &&) = delete;
    ~SceneLoad();
    /// Can a Streamer be made of it without a wait?
    bool ready() const;

  private:
    friend class Streamer;
    std::vector<std::shared_ptr<StreamItem>> reused_; // one per artifact; nullptr: it is opened
    std::unique_ptr<assets::ArtifactLoader> loader_;
};

class Streamer {
  public:
    /// Makes the device's objects of every mesh, texture and cube map of the scene, which `opening` is of; it
    /// is waited for. What was kept shares its objects with the streamer before; both may end in any order.
    /// Throws Error naming file and place.
    Streamer(const assets::SceneFile &file, SceneLoad load);
    Streamer(const assets::SceneFile &file, const std::filesystem::path &folder,
             const Streamer *before = nullptr);
    ~Streamer();
    Streamer(const Streamer &) = delete;
    Streamer &operator=(const Streamer &) = delete;

    const StreamedTexture *texture(std::string_view artifact) const;
    const StreamedMesh *mesh(std::string_view artifact) const; // empty for a tile of the terrain
    const StreamedTile &tile(std::size_t index) const;         // of Terrain::tiles

    /// Uploads at most `budget_bytes` (at least one step, so that it always gets on). True when all is
    /// resident. What another thread has not inflated yet is waited for, or left for a later frame: then no
    /// step may be made. Throws Error for a level that cannot be inflated.
    bool upload(std::size_t budget_bytes, NotReady not_ready = NotReady::wait);
    bool complete() const;
    std::uint64_t resident_bytes() const;
    std::uint64_t total_bytes() const;
    std::uint64_t terrain_bytes() const; // of the total
    std::size_t reused() const;          // artifacts that were taken from the scene before

  private:
    friend class SceneLoad;
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace paradize
