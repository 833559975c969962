#pragma once
// Uploads baked files to the GPU. Threads read and check the files; each frame uploads chunks within a byte
// budget, coarse data first.

#include "assets/scene_file.hpp"
#include "gl/handle.hpp"
#include "streaming/streamed_mesh.hpp"
#include "streaming/streamed_tile.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace paradize::assets {
class ArtifactLoader;
}

namespace paradize {

/// A texture that gets finer during playback. Until its first level is resident, bind() binds a neutral
/// texel: mid grey, or zero for SNORM maps (a flat normal, no distortion).
struct StreamItem;

class StreamedTexture {
  public:
    /// Binds the texture to a unit. `sampler` 0 uses the texture's own settings: repeat and trilinear, cube
    /// maps clamp.
    void bind(unsigned unit, unsigned sampler = 0) const;
    unsigned target() const { return target_; } // GL_TEXTURE_2D or GL_TEXTURE_CUBE_MAP
    int width_px() const { return width_px_; }
    int height_px() const { return height_px_; }
    int levels() const { return levels_; }
    bool has_green() const { return has_green_; }       // false: red only
    bool resident() const { return finest_ < levels_; } // at least one level is resident
    bool complete() const { return finest_ == 0; }      // all levels are resident

  private:
    friend class Streamer;
    friend struct StreamItem;
    gl::Texture texture_; // of the resident levels
    gl::Texture fallback_;
    unsigned target_ = 0;
    int width_px_ = 0, height_px_ = 0, levels_ = 0;
    bool has_green_ = false;
    int finest_ = 0; // finest resident level; levels_: none
};

enum class NotReady { wait, skip };

/// What a call of Streamer::upload() may use. At least one chunk is uploaded, so that streaming always
/// progresses.
struct UploadBudget {
    std::size_t bytes = std::numeric_limits<std::size_t>::max();
    double ms = std::numeric_limits<double>::infinity();
    // If the next piece is not in memory yet: wait for it, or take another one.
    NotReady not_ready = NotReady::wait;
};

class Streamer;

/// Limit of file bytes that wait in memory for upload. Beyond it, files are read again piece by piece.
inline constexpr std::uint64_t max_waiting_bytes = std::uint64_t{256} << 20U;

/// Reads and checks a scene's files on threads. Artifacts that are complete in `before` and have the same
/// SHA-256 are reused.
class SceneLoad {
  public:
    /// `file` must outlive this object.
    SceneLoad(const assets::SceneFile &file, const std::filesystem::path &folder,
              const Streamer *before = nullptr, std::uint64_t max_waiting = max_waiting_bytes);
    SceneLoad(SceneLoad &&) noexcept;
    SceneLoad &operator=(SceneLoad &&) = delete;
    ~SceneLoad();
    /// True if a Streamer can be created without waiting.
    bool ready() const;

  private:
    friend class Streamer;
    // one per artifact; nullptr: the artifact is read from its file
    std::vector<std::shared_ptr<StreamItem>> reused_;
    std::unique_ptr<assets::ArtifactLoader> loader_;
};

class Streamer {
  public:
    /// Waits for `load`, which must belong to `file`, and creates the GPU objects of all artifacts. Reused
    /// artifacts share their GPU objects with the previous streamer; the two may be destroyed in any order.
    /// Throws Error with file and place.
    Streamer(const assets::SceneFile &file, SceneLoad load);
    Streamer(const assets::SceneFile &file, const std::filesystem::path &folder,
             const Streamer *before = nullptr);
    ~Streamer();
    Streamer(const Streamer &) = delete;
    Streamer &operator=(const Streamer &) = delete;

    const StreamedTexture *texture(std::string_view artifact) const;
    const StreamedMesh *mesh(std::string_view artifact) const; // empty for a terrain tile
    const StreamedTile &tile(std::size_t index) const;         // index into Terrain::tiles

    /// Uploads within the budget. Returns true if everything is resident. Throws Error if a level is broken.
    bool upload(const UploadBudget &budget);
    bool complete() const;
    std::uint64_t resident_bytes() const;
    std::uint64_t total_bytes() const;
    std::uint64_t terrain_bytes() const; // part of total_bytes
    std::size_t reused() const;          // artifacts taken over from the previous scene
    /// One message for each file that could not be read again. What was resident of it stays.
    std::span<const std::string> failures() const;

  private:
    friend class SceneLoad;
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace paradize
