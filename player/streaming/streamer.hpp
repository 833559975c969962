#pragma once
// Uploads baked files to the GPU and evicts what is not needed. Threads read and check the files; each frame
// uploads chunks of checked files within a budget, in the order of the Schedule.

#include "assets/scene/file.hpp"
#include "assets/upload_plan.hpp"
#include "gl/handle.hpp"
#include "streaming/schedule.hpp"
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
#include <utility>
#include <vector>

namespace paradize::assets {
class ArtifactLoader;
class CheckedFiles;
} // namespace paradize::assets

namespace paradize {

struct StreamItem;

/// A texture that gets finer during playback. Until its first level is resident, bind() binds a neutral
/// texel: mid grey, or zero for SNORM maps (a flat normal, no distortion).
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
    int finest() const { return finest_; }              // finest resident level; levels(): none
    bool resident() const { return finest_ < levels_; } // at least one level is resident
    bool complete() const { return finest_ == 0; }      // all levels are resident

  private:
    friend class Streamer;
    friend struct StreamItem;
    gl::Texture texture_;         // of the resident levels, and with room for finer ones
    std::uint32_t room_from_ = 0; // level of the file that is its level 0
    gl::Texture fallback_;
    unsigned target_ = 0;
    int width_px_ = 0, height_px_ = 0, levels_ = 0;
    bool has_green_ = false;
    int finest_ = 0; // finest resident level; levels_: none
};

/// The choice if the next piece is not in memory yet: wait for it, or take another one. `wait_if_seen` waits,
/// but a call that uploads what is needed now begins no file of which nothing is needed now: a picture does
/// not wait for files that it does not show.
enum class NotReady { wait, wait_if_seen, skip };

/// Milliseconds of a clock that is never set.
double steady_ms();

/// The budget of a call of Streamer::upload(). At least one chunk is uploaded, so that streaming always
/// progresses.
struct UploadBudget {
    std::size_t bytes = std::numeric_limits<std::size_t>::max();
    /// The same for pieces whose absence shows now as more than twice the accepted error, where it is more.
    std::size_t urgent_bytes = 0;
    double ms = std::numeric_limits<double>::infinity();
    NotReady not_ready = NotReady::wait;
    double (*now_ms)() = steady_ms; // the clock of `ms`
};

class Streamer;
struct Uploads;

struct MemoryLimits {
    std::uint64_t vram_bytes = 0; // of meshes and textures on the device; 0: no limit
    // File bytes that wait in memory. Beyond it, files are read again piece by piece.
    std::uint64_t ram_bytes = std::uint64_t{256} << 20U;
    UploadOrder order = UploadOrder::needs;
};

struct StreamingCounts {
    std::uint64_t resident_bytes = 0;
    std::uint64_t total_bytes = 0;            // of all that the scene refers to
    std::uint64_t terrain_bytes = 0;          // part of total_bytes
    std::uint64_t needed_bytes = 0;           // by the last frame that was not settled, resident or not
    std::uint64_t peak_bytes = 0;             // largest so far, with the copies that uploads need
    std::uint64_t uploads = 0, evictions = 0; // pieces
    std::uint64_t uploaded_bytes = 0;
    double open_ms = 0.0;          // processor time for opening all files and reading their headers
    double read_bytes_per_s = 0.0; // of a thread that reads, checks and inflates; 0: nothing was read yet
    float worst_error = 0.0F; // on screen, relative to the accepted error; 0: all that is needed is there
};

/// Opens a scene's files on threads. Artifacts that are complete in `before` and have the same
/// SHA-256 are reused.
class SceneLoad {
  public:
    /// `file` must outlive this object.
    SceneLoad(const assets::SceneFile &file, const std::filesystem::path &folder,
              const Streamer *before = nullptr, const MemoryLimits &limits = {});
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
    std::unique_ptr<assets::CheckedFiles> checked_files_;
    MemoryLimits limits_;
};

class Streamer {
  public:
    /// Waits for `load`, which must belong to `file`. From then on threads read and check the files, in the
    /// order in which pieces of them are needed. Reused artifacts share their GPU objects with the previous
    /// streamer; the two may be destroyed in any order. Throws Error with file and place.
    Streamer(const assets::SceneFile &file, SceneLoad load);
    Streamer(const assets::SceneFile &file, const std::filesystem::path &folder,
             const Streamer *before = nullptr);
    ~Streamer();
    Streamer(const Streamer &) = delete;
    Streamer &operator=(const Streamer &) = delete;

    const StreamedTexture *texture(std::string_view artifact) const;
    const StreamedMesh *mesh(std::string_view artifact) const; // empty for a terrain tile
    const StreamedTile &tile(std::size_t index) const;         // index into Terrain::tiles

    /// The pieces of all artifacts; those of an artifact follow one another, coarse before fine.
    std::size_t piece_count() const;
    const assets::Piece &piece(std::uint32_t index) const;
    /// Returns the first piece and the number of pieces. {0, 0} for an unknown name.
    std::pair<std::uint32_t, std::uint32_t> pieces_of(std::string_view artifact) const;

    /// Says how much each piece is needed. Without it all are needed alike.
    void set_needs(std::span<const Need> needs);
    /// Lets the threads check and read what is needed first, for upload() to find it done. upload() does so
    /// too.
    void begin_reading();
    /// Evicts and uploads within the budget. Returns true if there is nothing left to upload: everything is
    /// resident, or all that is needed and fits the limit of device memory. Nothing is uploaded of a file
    /// before it is checked. Throws Error if a file is damaged.
    bool upload(const UploadBudget &budget);
    /// Waits until all files are checked. Throws Error if one is damaged.
    void finish_checks();
    /// True if all files are checked. Throws Error if one is damaged.
    bool checked();
    /// True if everything is resident.
    bool complete() const;
    /// True if everything is resident and nothing will be evicted: needs have no effect.
    bool settled() const;
    const StreamingCounts &counts() const;
    std::size_t reused() const; // artifacts taken over from the previous scene
    /// One message for each file that could not be read again. What was resident of it stays.
    std::span<const std::string> failures() const;

  private:
    friend class SceneLoad;
    std::unique_ptr<Uploads> uploads_;
};

} // namespace paradize
