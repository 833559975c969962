#pragma once
// The scene that is shown, and the one that takes its place when a bake has replaced scene.json.

#include "assets/scene_file.hpp"
#include "assets/watcher.hpp"
#include "streaming/scene.hpp"
#include "streaming/streamer.hpp"

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>

namespace paradize {

/// A scene.json whose files threads read and check.
struct PendingScene {
    /// What `before` has and what did not change is kept.
    PendingScene(assets::SceneFile scene_file, const std::filesystem::path &folder,
                 const Streamer *before = nullptr);

    std::unique_ptr<const assets::SceneFile> file;
    SceneLoad load;
};

/// Everything that comes of one scene.json.
struct LoadedScene {
    /// Waits for the files. Throws Error.
    explicit LoadedScene(PendingScene pending);

    const std::unique_ptr<const assets::SceneFile> owned_file;
    const assets::SceneFile &file;
    Streamer streamer;
    Scene scene;
};

class SceneSwap {
  public:
    /// rebaked: where new scenes come from; nullptr: none will. It outlives this. Throws Error.
    SceneSwap(PendingScene first, std::filesystem::path folder, assets::SceneWatcher *watcher);

    LoadedScene &current() { return *current_; }
    const LoadedScene &current() const { return *current_; }
    /// Uploads at most so much, of the scene that came if one did, else of the one that is shown. Returns the
    /// new one once it is resident, for turn(); nullptr: go on with the old one. Files that are still read
    /// are waited for, or left for a later frame. A scene that cannot be shown is told once, on standard
    /// error, and forgotten. Throws Error for a fault of the one shown.
    LoadedScene *upload(std::size_t budget_bytes, NotReady not_ready);
    /// Shows the new one from now on. What is returned must stay until nothing refers to it.
    std::unique_ptr<LoadedScene> activate();
    /// Forgets the new one, which `fault` keeps from being shown.
    void refuse(const char *error);

  private:
    void poll(NotReady not_ready);

    std::filesystem::path folder_;
    assets::SceneWatcher *watcher_;
    std::unique_ptr<LoadedScene> current_, next_;
    std::optional<PendingScene> pending_;
    assets::FileStamp stamp_{}; // of the new one
};

} // namespace paradize
