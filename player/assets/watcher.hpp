#pragma once
// Watches a scene's folder on a thread, and reads scene.json whenever a bake replaces it.

#include "assets/file_bytes.hpp"
#include "assets/scene/file.hpp"

#include <atomic>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>

namespace paradize::assets {

/// A new scene.json, or why it could not be read.
struct SceneUpdate {
    FileStamp stamp{};
    SceneFile file;
    std::string error; // empty: no error
};

class SceneWatcher {
  public:
    /// Starts watching. Create it before scene.json is first read. Throws Error if the system has no file
    /// descriptor left.
    explicit SceneWatcher(std::filesystem::path scene_json);
    ~SceneWatcher();
    SceneWatcher(const SceneWatcher &) = delete;
    SceneWatcher &operator=(const SceneWatcher &) = delete;

    /// Returns the newest update since the last call, or nullptr. Neither waits nor allocates.
    std::unique_ptr<SceneUpdate> take();
    /// The stamp of scene.json when this object was made.
    const FileStamp &first_stamp() const { return first_stamp_; }
    /// True if scene.json has changed since this stamp. Its artifacts may be gone then.
    bool outdated(const FileStamp &stamp) const { return stamp_of(path_) != stamp; }
    /// True if there is another scene.json than that of this stamp.
    bool newer(const FileStamp &stamp) const {
        const FileStamp now = stamp_of(path_);
        return now != FileStamp{} && now != stamp;
    }

  private:
    void run(const std::stop_token &stop);
    std::unique_ptr<SceneUpdate> read() const;

    std::filesystem::path path_;
    const FileStamp first_stamp_;
    FileStamp last_stamp_; // of the thread
    int wake_ = -1;        // eventfd that ends the thread
    int notify_ = -1;      // inotify descriptor of the folder; -1: only polling
    std::atomic<SceneUpdate *> update_{nullptr};
    std::jthread thread_;
};

} // namespace paradize::assets
