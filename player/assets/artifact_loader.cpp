#include "assets/artifact_loader.hpp"

#include "assets/file_checker.hpp"
#include "error.hpp"

#include <ctime>
#include <exception>
#include <utility>

namespace paradize::assets {

ArtifactLoader::ArtifactLoader(const SceneFile &scene, std::filesystem::path folder,
                               std::vector<std::uint32_t> wanted)
    : scene_(scene), folder_(std::move(folder)), wanted_(std::move(wanted)), loaded_(wanted_.size()),
      errors_(wanted_.size()), first_error_(wanted_.size()) {
    std::vector<std::size_t> sizes;
    for (const std::uint32_t index : wanted_) {
        sizes.push_back(static_cast<std::size_t>(scene_.artifacts[index].bytes));
    }
    memory_ = ReservedMemory::side_by_side(sizes);
    const std::size_t threads = loader_threads(wanted_.size());
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
            std::optional<ReservedMemory> memory;
            if (!memory_.empty()) {
                memory = std::move(memory_[i]);
            }
            loaded_[i] = open_artifact(scene_, wanted_[i], folder_, stop, std::move(memory));
        } catch (const std::exception &error) { // take() rethrows it
            errors_[i] = error.what();
            std::size_t first = first_error_.load();
            while (i < first && !first_error_.compare_exchange_weak(first, i)) {
            }
        }
    }
    timespec used{};
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
    cpu_ns_.fetch_add(std::int64_t{used.tv_sec} * 1'000'000'000 + used.tv_nsec);
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
