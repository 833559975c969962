#pragma once
// Opens artifacts on threads, so that the drawing thread does not wait for the disk.

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
    /// `wanted` holds indices of artifacts, opened in this order. `scene` must outlive this object.
    ArtifactLoader(const SceneFile &scene, std::filesystem::path folder, std::vector<std::uint32_t> wanted);
    ~ArtifactLoader();
    ArtifactLoader(const ArtifactLoader &) = delete;
    ArtifactLoader &operator=(const ArtifactLoader &) = delete;

    const std::vector<std::uint32_t> &wanted() const { return wanted_; }
    /// True if take() would return at once.
    bool ready() const { return left_.load(std::memory_order_acquire) == 0; }
    /// Processor time that the threads took, milliseconds. Call after take().
    double open_ms() const { return 1e-6 * static_cast<double>(cpu_ns_.load()); }
    /// Waits for all artifacts and returns them in the order of `wanted`: opened, not checked. Call once.
    /// Throws Error: the first artifact's error.
    std::vector<LoadedArtifact> take();

  private:
    void work(const std::stop_token &stop);

    const SceneFile &scene_;
    const std::filesystem::path folder_;
    const std::vector<std::uint32_t> wanted_;
    std::vector<ReservedMemory> memory_; // for wanted_; empty: each file gets its own
    std::vector<LoadedArtifact> loaded_; // in the order of wanted_; each entry is written by one thread
    std::vector<std::string> errors_;    // empty: no error
    std::atomic<std::size_t> next_{0};
    std::atomic<std::size_t> first_error_; // artifacts after it are not opened
    std::atomic<std::size_t> left_;        // running threads
    std::atomic<std::int64_t> cpu_ns_{0};
    std::vector<std::jthread> threads_;
};

} // namespace paradize::assets
