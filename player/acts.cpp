#include "acts.hpp"

#include "error.hpp"
#include "messages.hpp"

#include <string>
#include <utility>

namespace paradize {

Act::Act(assets::SceneFile scene_file, const std::filesystem::path &folder, const Act *before)
    : file(std::move(scene_file)), streamer(file, folder, before != nullptr ? &before->streamer : nullptr),
      scene(file, streamer) {}

Acts::Acts(assets::SceneFile first, std::filesystem::path folder, assets::Rebaked *rebaked)
    : folder_(std::move(folder)), rebaked_(rebaked), now_(std::make_unique<Act>(std::move(first), folder_)) {}

void Acts::refuse(const char *fault) {
    next_.reset();
    // Where yet another bake is done, the files of this one may be gone, and its scene is on the way.
    if (!rebaked_->outdated(stamp_)) {
        say(std::string("the new scene is not shown, the one before stays: ") + fault);
    }
}

/// Takes a scene that came.
void Acts::look() {
    const std::unique_ptr<assets::RebakedScene> found = rebaked_->take();
    if (!found) {
        return;
    }
    stamp_ = found->stamp;
    if (!found->fault.empty()) {
        refuse(found->fault.c_str());
        return;
    }
    try {
        next_ = std::make_unique<Act>(std::move(found->file), folder_, now_.get());
    } catch (const Error &error) {
        refuse(error.what());
    }
}

Act *Acts::upload(std::size_t budget_bytes, Unready unready) {
    if (rebaked_ != nullptr) {
        look();
    }
    if (!next_) {
        now_->streamer.upload(budget_bytes, unready);
        return nullptr;
    }
    try {
        return next_->streamer.upload(budget_bytes, unready) ? next_.get() : nullptr;
    } catch (const Error &error) {
        refuse(error.what());
        return nullptr;
    }
}

std::unique_ptr<Act> Acts::turn() {
    return std::exchange(now_, std::move(next_));
}

} // namespace paradize
