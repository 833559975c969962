#include "assets/watcher.hpp"

#include "error.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <exception>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/inotify.h>
#include <unistd.h>
#include <utility>

namespace paradize::assets {

namespace {

// Interval for file systems without inotify events, such as network file systems.
constexpr int poll_ms = 500;

} // namespace

SceneWatcher::SceneWatcher(std::filesystem::path scene_json)
    : path_(std::move(scene_json)), first_stamp_(stamp_of(path_)), last_stamp_(first_stamp_),
      wake_(::eventfd(0, EFD_CLOEXEC)) {
    if (wake_ < 0) {
        throw Error(path_.string() + ": cannot be watched: " + std::strerror(errno));
    }
    notify_ = ::inotify_init1(IN_CLOEXEC | IN_NONBLOCK);
    if (notify_ >= 0) {
        const std::filesystem::path folder = path_.has_parent_path() ? path_.parent_path() : ".";
        // otherwise poll_ms finds changes
        ::inotify_add_watch(notify_, folder.c_str(), IN_MOVED_TO | IN_CLOSE_WRITE);
    }
    thread_ = std::jthread([this](const std::stop_token &stop) { run(stop); });
}

SceneWatcher::~SceneWatcher() {
    thread_.request_stop();
    ::eventfd_write(wake_, 1);
    thread_.join();
    ::close(wake_);
    if (notify_ >= 0) {
        ::close(notify_);
    }
    delete update_.exchange(nullptr);
}

std::unique_ptr<SceneUpdate> SceneWatcher::take() {
    return std::unique_ptr<SceneUpdate>(update_.exchange(nullptr, std::memory_order_acquire));
}

void SceneWatcher::run(const std::stop_token &stop) {
    std::array<char, 4096> events{}; // the content is ignored: the stamp shows changes
    while (true) {
        std::array<pollfd, 2> waits{{{wake_, POLLIN, 0}, {notify_, POLLIN, 0}}};
        ::poll(waits.data(), waits.size(), poll_ms);
        if (stop.stop_requested()) {
            return;
        }
        while (notify_ >= 0 && ::read(notify_, events.data(), events.size()) > 0) {
        }
        for (FileStamp now = stamp_of(path_); now != FileStamp{} && now != last_stamp_;
             now = stamp_of(path_)) {
            last_stamp_ = now;
            std::unique_ptr<SceneUpdate> update = read();
            if (!outdated(last_stamp_)) {
                delete update_.exchange(update.release(), std::memory_order_acq_rel);
            }
        }
    }
}

std::unique_ptr<SceneUpdate> SceneWatcher::read() const {
    auto update = std::make_unique<SceneUpdate>();
    update->stamp = last_stamp_;
    try {
        update->file = read_scene(path_);
    } catch (const std::exception &error) { // reported by the drawing thread
        update->error = error.what();
    }
    return update;
}

} // namespace paradize::assets
