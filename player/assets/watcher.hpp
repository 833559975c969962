#pragma once
// A thread that follows a scene's folder: whenever a bake replaces scene.json, it reads the new one.

#include "assets/scene_file.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>

namespace paradize::assets {

/// What tells one scene.json from the next: device, inode, bytes, times of its text and of its entry in
/// nanoseconds; zeros: there is none.
using FileStamp = std::array<std::int64_t, 5>;
FileStamp stamp_of(const std::filesystem::path &file);

/// A scene.json that took the place of another, or what is wrong with it.
struct SceneUpdate {
    FileStamp stamp{};
    SceneFile file;
    std::string error; // empty: none
};

class SceneWatcher {
  public:
    /// Follows from now on: make it before the first scene.json is read. Throws Error when the system has no
    /// descriptor left.
    explicit SceneWatcher(std::filesystem::path scene_json);
    ~SceneWatcher();
    SceneWatcher(const SceneWatcher &) = delete;
    SceneWatcher &operator=(const SceneWatcher &) = delete;

    /// The last one that came since the last call; nullptr: none. Neither waits nor allocates.
    std::unique_ptr<SceneUpdate> take();
    /// Has another one come since this one was read? Its artifacts may be gone then.
    bool outdated(const FileStamp &stamp) const { return stamp_of(path_) != stamp; }

  private:
    void run(const std::stop_token &stop);
    std::unique_ptr<SceneUpdate> read() const;

    std::filesystem::path path_;
    FileStamp last_stamp_;
    int wake_ = -1;   // eventfd: the thread is to end
    int notify_ = -1; // inotify of the folder; -1: the file is looked at now and then
    std::atomic<SceneUpdate *> update_{nullptr};
    std::jthread thread_;
};

} // namespace paradize::assets
