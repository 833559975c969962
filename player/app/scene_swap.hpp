#pragma once
// Holds the current scene, and loads the next one when a new bake has replaced scene.json.

#include "assets/scene/file.hpp"
#include "assets/watcher.hpp"
#include "streaming/demand.hpp"
#include "streaming/scene.hpp"
#include "streaming/streamer.hpp"

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>

namespace paradize {

/// A scene.json whose files are being read and checked by threads.
struct PendingScene {
    /// Artifacts that are unchanged in `before` are reused. Without a limit of device memory that of the
    /// scene holds. Throws Error if it has one and the order is that of the file.
    PendingScene(assets::SceneFile scene_file, const std::filesystem::path &folder, MemoryLimits limits = {},
                 const Streamer *before = nullptr);

    std::unique_ptr<const assets::SceneFile> file;
    SceneLoad load;
};

/// Everything that is created from one scene.json.
struct LoadedScene {
    /// Waits until the files are read. Throws Error.
    explicit LoadedScene(PendingScene pending);

    const std::unique_ptr<const assets::SceneFile> owned_file;
    const assets::SceneFile &file;
    Streamer streamer;
    Scene scene;
    Demand demand;
    std::size_t logged_failures = 0; // of the streamer's
};

class SceneSwap {
  public:
    /// `watcher` supplies new scenes and must outlive this object. nullptr: there are no new scenes. Throws
    /// Error.
    SceneSwap(PendingScene first, std::filesystem::path folder, const MemoryLimits &limits,
              assets::SceneWatcher *watcher);

    LoadedScene &current() { return *current_; }
    const LoadedScene &current() const { return *current_; }
    /// Lets threads read what the first picture shows, while the shaders are compiled.
    void begin_reading(const CameraForecast &forecast);
    /// Uploads within the budget, to the next scene if there is one, else to the current scene. Returns the
    /// next scene once it is resident; call activate() then. Otherwise returns nullptr. An error of the next
    /// scene is logged once and that scene is dropped. A file of the current scene that cannot be read any
    /// more is logged once. Throws Error if the current scene fails, unless a newer one comes: its bake
    /// removes files of the one before.
    LoadedScene *upload(const CameraForecast &forecast, const UploadBudget &budget);
    /// Uploads all of the current scene, or all that is needed and fits the limit.
    void upload_all(const CameraForecast &forecast);
    /// Makes the next scene the current one. Returns the previous scene; keep it until nothing refers to it.
    std::unique_ptr<LoadedScene> activate();
    /// Drops the next scene and logs `error`.
    void refuse(const char *error);

  private:
    void poll(NotReady not_ready);
    bool newer_scene_comes() const;
    void log_failures();

    std::filesystem::path folder_;
    MemoryLimits limits_;
    assets::SceneWatcher *watcher_;
    std::unique_ptr<LoadedScene> current_, next_;
    std::optional<PendingScene> pending_;
    assets::FileStamp stamp_{}; // of the newest scene that was taken
};

} // namespace paradize
