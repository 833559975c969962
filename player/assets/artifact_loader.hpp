#pragma once
// Threads that open artifacts: the drawing thread waits neither for the disk nor for a hash.

#include "assets/loaded_artifact.hpp"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

namespace paradize::assets {

class ArtifactLoader {
  public:
    /// `wanted`: indices of artifacts, the first one first. `scene` outlives this. Of files that have more
    /// than `max_waiting` bytes together some keep only what is coarse: see release_fine().
    ArtifactLoader(const SceneFile &scene, std::filesystem::path folder, std::vector<std::uint32_t> wanted,
                   std::uint64_t max_waiting);
    ~ArtifactLoader();
    ArtifactLoader(const ArtifactLoader &) = delete;
    ArtifactLoader &operator=(const ArtifactLoader &) = delete;

    const std::vector<std::uint32_t> &wanted() const { return wanted_; }
    /// Would take() return at once?
    bool ready() const { return left_.load(std::memory_order_acquire) == 0; }
    /// Waits; once. As `wanted`. Throws Error: the fault of the first that has one.
    std::vector<LoadedArtifact> take();

  private:
    void work(const std::stop_token &stop);

    const SceneFile &scene_;
    const std::filesystem::path folder_;
    const std::vector<std::uint32_t> wanted_;
    std::vector<LoadedArtifact> loaded_; // as wanted_; each is written by one thread
    std::vector<std::string> errors_;    // empty: none
    const std::uint64_t max_waiting_bytes_;
    std::atomic<std::uint64_t> waiting_bytes_{0};
    std::atomic<std::size_t> next_{0};
    std::atomic<std::size_t> first_error_; // what comes after it is not opened
    std::atomic<std::size_t> left_;        // threads that are at work
    std::vector<std::jthread> threads_;
};

} // namespace paradize::assets
