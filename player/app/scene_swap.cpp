#include "app/scene_swap.hpp"

#include "app/messages.hpp"
#include "error.hpp"
#include "number_text.hpp"

#include <exception>
#include <span>
#include <string>
#include <utility>

namespace paradize {

namespace {

MemoryLimits limits_for(const assets::SceneFile &file, MemoryLimits limits) {
    if (limits.vram_bytes == 0 && file.vram_mb) {
        if (limits.order == UploadOrder::file) {
            throw Error("scene.json: vram_mb: is " + shortest(*file.vram_mb) +
                        ": --order file uploads everything, a limit of device memory only what the picture "
                        "needs most: leave out one of them");
        }
        limits.vram_bytes = static_cast<std::uint64_t>(*file.vram_mb * 1e6);
    }
    return limits;
}

void set_needs(LoadedScene &scene, const CameraForecast &forecast) {
    scene.demand.update(forecast);
    scene.streamer.set_needs(scene.demand.needs());
}

bool upload_needed(LoadedScene &scene, const CameraForecast &forecast, const UploadBudget &budget) {
    if (!scene.streamer.settled()) {
        set_needs(scene, forecast);
    }
    return scene.streamer.upload(budget);
}

} // namespace

PendingScene::PendingScene(assets::SceneFile scene_file, const std::filesystem::path &folder,
                           MemoryLimits limits, const Streamer *before)
    : file(std::make_unique<const assets::SceneFile>(std::move(scene_file))),
      load(*file, folder, before, limits_for(*file, limits)) {}

LoadedScene::LoadedScene(PendingScene pending)
    : owned_file(std::move(pending.file)), file(*owned_file), streamer(file, std::move(pending.load)),
      scene(file, streamer), demand(scene, streamer) {}

SceneSwap::SceneSwap(PendingScene first, std::filesystem::path folder, const MemoryLimits &limits,
                     assets::SceneWatcher *watcher)
    : folder_(std::move(folder)), limits_(limits), watcher_(watcher),
      current_(std::make_unique<LoadedScene>(std::move(first))),
      stamp_(watcher == nullptr ? assets::FileStamp{} : watcher->first_stamp()) {}

void SceneSwap::refuse(const char *error) {
    next_.reset();
    pending_.reset();
    // If scene.json has changed again, this scene's files may be gone. The newer scene follows, so no message
    // is needed.
    if (!watcher_->outdated(stamp_)) {
        log_message(std::string("the new scene cannot be shown, the previous one stays: ") + error);
    }
}

/// Takes an update from the watcher, and loads it once its files are read.
void SceneSwap::poll(NotReady not_ready) {
    try {
        if (const std::unique_ptr<assets::SceneUpdate> update = watcher_->take()) {
            stamp_ = update->stamp;
            if (!update->error.empty()) {
                refuse(update->error.c_str());
                return;
            }
            next_.reset();
            pending_.emplace(std::move(update->file), folder_, limits_, &current_->streamer);
        }
        if (pending_ && (not_ready != NotReady::skip || pending_->load.ready())) {
            next_ = std::make_unique<LoadedScene>(std::move(*pending_));
            pending_.reset();
        }
    } catch (const std::exception &error) {
        refuse(error.what());
    }
}

bool SceneSwap::newer_scene_comes() const {
    return pending_ || (watcher_ != nullptr && watcher_->newer(stamp_));
}

void SceneSwap::log_failures() {
    const std::span<const std::string> all = current_->streamer.failures();
    for (std::size_t &logged = current_->logged_failures; logged < all.size(); ++logged) {
        log_message(all[logged] + "; what was loaded of it is drawn");
    }
}

void SceneSwap::begin_reading(const CameraForecast &forecast) {
    set_needs(*current_, forecast);
    current_->streamer.begin_reading();
}

void SceneSwap::upload_all(const CameraForecast &forecast) {
    current_->streamer.finish_checks();
    upload_needed(*current_, forecast, {});
    log_failures();
}

LoadedScene *SceneSwap::upload(const CameraForecast &forecast, const UploadBudget &budget) {
    if (watcher_ != nullptr) {
        poll(budget.not_ready);
    }
    if (!next_) {
        try {
            upload_needed(*current_, forecast, budget);
        } catch (const Error &) {
            if (!newer_scene_comes()) {
                throw;
            }
        }
        log_failures();
        return nullptr;
    }
    try {
        bool complete = upload_needed(*next_, forecast, budget);
        if (complete && budget.not_ready != NotReady::skip) {
            next_->streamer.finish_checks();
        }
        complete = complete && next_->streamer.checked();
        if (!next_->streamer.failures().empty()) {
            throw Error(next_->streamer.failures().front());
        }
        return complete ? next_.get() : nullptr;
    } catch (const std::exception &error) {
        refuse(error.what());
        return nullptr;
    }
}

std::unique_ptr<LoadedScene> SceneSwap::activate() {
    return std::exchange(current_, std::move(next_));
}

} // namespace paradize
