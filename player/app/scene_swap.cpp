#include "app/scene_swap.hpp"

#include "app/messages.hpp"

#include <exception>
#include <string>
#include <utility>

namespace paradize {

ComingScene::ComingScene(assets::SceneFile scene_file, const std::filesystem::path &folder,
                         const Streamer *before)
    : file(std::make_unique<const assets::SceneFile>(std::move(scene_file))), opening(*file, folder, before) {
}

LoadedScene::LoadedScene(ComingScene coming)
    : held(std::move(coming.file)), file(*held), streamer(file, std::move(coming.opening)),
      scene(file, streamer) {}

SceneSwap::SceneSwap(ComingScene first, std::filesystem::path folder, assets::SceneWatcher *rebaked)
    : folder_(std::move(folder)), rebaked_(rebaked), now_(std::make_unique<LoadedScene>(std::move(first))) {}

void SceneSwap::refuse(const char *fault) {
    next_.reset();
    coming_.reset();
    // Where yet another bake is done, the files of this one may be gone, and its scene is on the way.
    if (!rebaked_->outdated(stamp_)) {
        say(std::string("the new scene is not shown, the one before stays: ") + fault);
    }
}

/// Takes a scene that came, and makes an act of it once its files are there.
void SceneSwap::look(Unready unready) {
    try {
        if (const std::unique_ptr<assets::RebakedScene> found = rebaked_->take()) {
            stamp_ = found->stamp;
            if (!found->fault.empty()) {
                refuse(found->fault.c_str());
                return;
            }
            next_.reset();
            coming_.emplace(std::move(found->file), folder_, &now_->streamer);
        }
        if (coming_ && (unready == Unready::wait || coming_->opening.ready())) {
            next_ = std::make_unique<LoadedScene>(std::move(*coming_));
            coming_.reset();
        }
    } catch (const std::exception &error) {
        refuse(error.what());
    }
}

LoadedScene *SceneSwap::upload(std::size_t budget_bytes, Unready unready) {
    if (rebaked_ != nullptr) {
        look(unready);
    }
    if (!next_) {
        now_->streamer.upload(budget_bytes, unready);
        return nullptr;
    }
    try {
        return next_->streamer.upload(budget_bytes, unready) ? next_.get() : nullptr;
    } catch (const std::exception &error) {
        refuse(error.what());
        return nullptr;
    }
}

std::unique_ptr<LoadedScene> SceneSwap::turn() {
    return std::exchange(now_, std::move(next_));
}

} // namespace paradize
