#include "assets/opener.hpp"

#include "error.hpp"

#include <algorithm>
#include <exception>
#include <utility>

namespace paradize::assets {

namespace {

constexpr unsigned most_threads = 8;

} // namespace

Opener::Opener(const SceneFile &scene, std::filesystem::path folder, std::vector<std::uint32_t> wanted,
               std::uint64_t most_held)
    : scene_(scene), folder_(std::move(folder)), wanted_(std::move(wanted)), opened_(wanted_.size()),
      faults_(wanted_.size()), most_held_(most_held), first_fault_(wanted_.size()) {
    const auto threads = std::min<std::size_t>(
        wanted_.size(), std::clamp(std::thread::hardware_concurrency(), 1U, most_threads));
    left_.store(threads, std::memory_order_relaxed);
    for (std::size_t i = 0; i < threads; ++i) {
        threads_.emplace_back([this](const std::stop_token &stop) { work(stop); });
    }
}

Opener::~Opener() {
    for (std::jthread &thread : threads_) {
        thread.request_stop(); // all of them before the first is waited for
    }
}

void Opener::work(const std::stop_token &stop) {
    for (std::size_t i = next_.fetch_add(1); i < first_fault_.load(); i = next_.fetch_add(1)) {
        try {
            opened_[i] = open_artifact(scene_, wanted_[i], folder_, stop);
            const std::uint64_t bytes = opened_[i].file.bytes().size();
            if (held_.fetch_add(bytes) + bytes > most_held_) {
                held_.fetch_sub(bytes);
                release_fine(opened_[i]);
            }
        } catch (const std::exception &error) { // the thread's end: take() tells
            faults_[i] = error.what();
            std::size_t first = first_fault_.load();
            while (i < first && !first_fault_.compare_exchange_weak(first, i)) {
            }
        }
    }
    left_.fetch_sub(1, std::memory_order_release);
}

std::vector<OpenedArtifact> Opener::take() {
    for (std::jthread &thread : threads_) {
        thread.join();
    }
    threads_.clear();
    if (const std::size_t first = first_fault_.load(); first < faults_.size()) {
        throw Error(faults_[first]);
    }
    return std::move(opened_);
}

} // namespace paradize::assets
