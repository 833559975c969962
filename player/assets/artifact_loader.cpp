#include "assets/artifact_loader.hpp"

#include "error.hpp"

#include <algorithm>
#include <exception>
#include <utility>

namespace paradize::assets {

namespace {

constexpr unsigned max_threads = 8;

} // namespace

ArtifactLoader::ArtifactLoader(const SceneFile &scene, std::filesystem::path folder,
                               std::vector<std::uint32_t> wanted, std::uint64_t max_waiting)
    : scene_(scene), folder_(std::move(folder)), wanted_(std::move(wanted)), loaded_(wanted_.size()),
      errors_(wanted_.size()), max_waiting_bytes_(max_waiting), first_error_(wanted_.size()) {
    const auto threads = std::min<std::size_t>(
        wanted_.size(), std::clamp(std::thread::hardware_concurrency(), 1U, max_threads));
    left_.store(threads, std::memory_order_relaxed);
    for (std::size_t i = 0; i < threads; ++i) {
        threads_.emplace_back([this](const std::stop_token &stop) { work(stop); });
    }
}

ArtifactLoader::~ArtifactLoader() {
    for (std::jthread &thread : threads_) {
        thread.request_stop(); // all threads stop before the first is joined
    }
}

void ArtifactLoader::work(const std::stop_token &stop) {
    for (std::size_t i = next_.fetch_add(1); i < first_error_.load(); i = next_.fetch_add(1)) {
        try {
            loaded_[i] = load_artifact(scene_, wanted_[i], folder_, stop);
            const std::uint64_t bytes = loaded_[i].file.bytes().size();
            if (waiting_bytes_.fetch_add(bytes) + bytes > max_waiting_bytes_) {
                waiting_bytes_.fetch_sub(bytes);
                free_memory(loaded_[i]);
            }
        } catch (const std::exception &error) { // take() rethrows it
            errors_[i] = error.what();
            std::size_t first = first_error_.load();
            while (i < first && !first_error_.compare_exchange_weak(first, i)) {
            }
        }
    }
    left_.fetch_sub(1, std::memory_order_release);
}

std::vector<LoadedArtifact> ArtifactLoader::take() {
    for (std::jthread &thread : threads_) {
        thread.join();
    }
    threads_.clear();
    if (const std::size_t first = first_error_.load(); first < errors_.size()) {
        throw Error(errors_[first]);
    }
    return std::move(loaded_);
}

} // namespace paradize::assets
